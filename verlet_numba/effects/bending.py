"""Resistance of cloth and ropes to bending: every angle that has been bent returns to that of the start.

Cloth bends about the edges between its triangles (physics/hinge.py), ropes about their particles (physics/angle.py). Angles are
corrected before sticks, which have the last word. Cloth's hinges are laid out in runs that share no particle. All in double
precision.

An angle returns to rest as a critically damped spring (physics/returning.py), whose rate is such that it loses the part `stiffness`
in a frame, whatever the substeps and passes. That is stiffness against its own particles' inertia, as of any position-based
constraint: finer cloth of the same stiffness hangs more softly. Waves over many angles are far slower than one angle, and so
hardly damped: a strip swings. Angles share particles, so that of a very stiff body one pass of few substeps corrects less than all.
"""

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.kernels.relax_angles import move_three
from verlet_numba.physics.angle import bend, between
from verlet_numba.physics.hinge import gradients, off_rest
from verlet_numba.physics.returning import owed


@kernel
def unbend(again, position, previous, bending):
    """One pass over all angles; in the first one of a substep, what it began with is noted."""
    if bending is None:
        return
    unfold(again, position, previous, bending.share, bending.hinges)
    straighten(again, position, previous, bending.share, bending.joints)


@kernel
def unfold(again, position, previous, share, hinges):
    """The hinges of cloth."""
    if hinges is None:
        return
    if not again:
        note_folds(previous, hinges)
    x, y, z = position[0], position[1], position[2]
    spring, damper, memory = share[0], share[1], share[2]
    for r in range(hinges.lanes.size):
        i, j, k, g = hinges.first[0, r], hinges.first[1, r], hinges.first[2, r], hinges.first[3, r]
        n, d = hinges.lanes[r], hinges.data[r]
        xa, ya, za, xb, yb, zb = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        xc, yc, zc, xd, yd, zd = x[k:k + n], y[k:k + n], z[k:k + n], x[g:g + n], y[g:g + n], z[g:g + n]
        wa, wb, wc, wd = hinges.weight[0, d:d + n], hinges.weight[1, d:d + n], hinges.weight[2, d:d + n], hinges.weight[3, d:d + n]
        cosine, sine = hinges.rest[0, d:d + n], hinges.rest[1, d:d + n]
        before, given = hinges.before[d:d + n], hinges.given[d:d + n]
        for m in range(n):
            ax, ay, az = np.float64(xa[m]), np.float64(ya[m]), np.float64(za[m])
            ex, ey, ez, px, py, pz = xb[m] - ax, yb[m] - ay, zb[m] - az, xc[m] - ax, yc[m] - ay, zc[m] - az
            qx, qy, qz = xd[m] - ax, yd[m] - ay, zd[m] - az
            error = off_rest(ex, ey, ez, px, py, pz, qx, qy, qz, cosine[m], sine[m])
            by = owed(error, before[m], given[m], spring, damper, memory)
            fa, ga, ha, fb, gb, hb, fc, gc, hc, fd, gd, hd = gradients(ex, ey, ez, px, py, pz, qx, qy, qz)
            total = (wa[m] * (fa * fa + ga * ga + ha * ha) + wb[m] * (fb * fb + gb * gb + hb * hb)
                     + wc[m] * (fc * fc + gc * gc + hc * hc) + wd[m] * (fd * fd + gd * gd + hd * hd))
            given[m] += by
            s = by / total if total > 0.0 else 0.0
            sa, sb, sc, sd = s * wa[m], s * wb[m], s * wc[m], s * wd[m]
            xa[m] -= sa * fa
            ya[m] -= sa * ga
            za[m] -= sa * ha
            xb[m] -= sb * fb
            yb[m] -= sb * gb
            zb[m] -= sb * hb
            xc[m] -= sc * fc
            yc[m] -= sc * gc
            zc[m] -= sc * hc
            xd[m] -= sd * fd
            yd[m] -= sd * gd
            zd[m] -= sd * hd


@kernel
def note_folds(previous, hinges):
    """How far hinges were off their rest when the substep began."""
    x, y, z = previous[0], previous[1], previous[2]
    for r in range(hinges.lanes.size):
        i, j, k, g = hinges.first[0, r], hinges.first[1, r], hinges.first[2, r], hinges.first[3, r]
        n, d = hinges.lanes[r], hinges.data[r]
        xa, ya, za, xb, yb, zb = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        xc, yc, zc, xd, yd, zd = x[k:k + n], y[k:k + n], z[k:k + n], x[g:g + n], y[g:g + n], z[g:g + n]
        cosine, sine = hinges.rest[0, d:d + n], hinges.rest[1, d:d + n]
        before, given = hinges.before[d:d + n], hinges.given[d:d + n]
        for m in range(n):
            ax, ay, az = np.float64(xa[m]), np.float64(ya[m]), np.float64(za[m])
            before[m] = off_rest(xb[m] - ax, yb[m] - ay, zb[m] - az, xc[m] - ax, yc[m] - ay, zc[m] - az,
                                 xd[m] - ax, yd[m] - ay, zd[m] - az, cosine[m], sine[m])
            given[m] = 0.0


@kernel
def straighten(again, position, previous, share, joints):
    """The particles within ropes, one after another."""
    if joints is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    for a in range(joints.rest.size):
        i, j, k = joints.corners[0, a], joints.corners[1, a], joints.corners[2, a]
        if not again:
            joints.before[a] = opening(u, v, w, i, j, k) - joints.rest[a]
            joints.given[a] = 0.0
        now = opening(x, y, z, i, j, k)
        by = owed(now - joints.rest[a], joints.before[a], joints.given[a], share[0], share[1], share[2])
        joints.given[a] += by
        jx, jy, jz = np.float64(x[j]), np.float64(y[j]), np.float64(z[j])
        moved = bend(x[i] - jx, y[i] - jy, z[i] - jz, x[k] - jx, y[k] - jy, z[k] - jz, now - by, 0.0,
                     joints.weight[0, a], joints.weight[1, a], joints.weight[2, a])
        move_three(x, y, z, i, j, k, moved)


@kernel
def opening(x, y, z, i, j, k):
    """The angle at particle j between the arms to i and k [rad]."""
    jx, jy, jz = np.float64(x[j]), np.float64(y[j]), np.float64(z[j])
    return between(x[i] - jx, y[i] - jy, z[i] - jz, x[k] - jx, y[k] - jy, z[k] - jz)
