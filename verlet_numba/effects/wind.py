"""Wind on the triangles of all bodies, each corner taking a third of the force."""

from verlet_numba._jit import entry
from verlet_numba.physics.wind import pressure

VALENCE = 6.0       # triangles about a corner: as many accelerate it together


@entry
def blow(position, previous, acceleration, h, wind):
    """Add the wind's force to what accelerates the particles so far; a triangle's velocity is the mean of its corners'.

    Triangles of a run share no particle, so they are lanes of one vector loop.
    """
    if wind is None:
        return
    x, y, z = position[0], position[1], position[2]
    u, v, w = previous[0], previous[1], previous[2]
    a, b, c = acceleration[0], acceleration[1], acceleration[2]
    zero, per, half = position.dtype.type(0), position.dtype.type(1.0 / (3.0 * h)), position.dtype.type(0.5 * VALENCE * h)
    for r in range(wind.lanes.size):
        i, j, k, n, d = wind.first[0, r], wind.first[1, r], wind.first[2, r], wind.lanes[r], wind.data[r]
        xi, yi, zi, ui, vi, wi = x[i:i + n], y[i:i + n], z[i:i + n], u[i:i + n], v[i:i + n], w[i:i + n]
        xj, yj, zj, uj, vj, wj = x[j:j + n], y[j:j + n], z[j:j + n], u[j:j + n], v[j:j + n], w[j:j + n]
        xk, yk, zk, uk, vk, wk = x[k:k + n], y[k:k + n], z[k:k + n], u[k:k + n], v[k:k + n], w[k:k + n]
        ai, bi, ci, aj, bj, cj = a[i:i + n], b[i:i + n], c[i:i + n], a[j:j + n], b[j:j + n], c[j:j + n]
        ak, bk, ck = a[k:k + n], b[k:k + n], c[k:k + n]
        si, sj, sk = wind.share[0, d:d + n], wind.share[1, d:d + n], wind.share[2, d:d + n]
        ax, ay, az = wind.velocity[0, d:d + n], wind.velocity[1, d:d + n], wind.velocity[2, d:d + n]
        for m in range(n):
            rx = ax[m] - per * ((xi[m] - ui[m]) + (xj[m] - uj[m]) + (xk[m] - uk[m]))
            ry = ay[m] - per * ((yi[m] - vi[m]) + (yj[m] - vj[m]) + (yk[m] - vk[m]))
            rz = az[m] - per * ((zi[m] - wi[m]) + (zj[m] - wj[m]) + (zk[m] - wk[m]))
            fx, fy, fz = pressure(xj[m] - xi[m], yj[m] - yi[m], zj[m] - zi[m],
                                  xk[m] - xi[m], yk[m] - yi[m], zk[m] - zi[m], rx, ry, rz,
                                  half * max(si[m], sj[m], sk[m]), zero)
            ai[m] += si[m] * fx
            bi[m] += si[m] * fy
            ci[m] += si[m] * fz
            aj[m] += sj[m] * fx
            bj[m] += sj[m] * fy
            cj[m] += sj[m] * fz
            ak[m] += sk[m] * fx
            bk[m] += sk[m] * fy
            ck[m] += sk[m] * fz
