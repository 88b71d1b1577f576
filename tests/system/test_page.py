"""Pages of `view` in a real browser: they play offline, answer keys, mouse and fingers, and show what the trajectory holds."""

import json

import browser
import h5py
import numpy as np
import pytest
from trajectories import variety, write

from verlet_numba.study.surfaces import PALETTE

pytestmark = pytest.mark.skipif(
    not (browser.found(browser.BROWSERS) and browser.found(browser.DRIVERS)),
    reason="needs Chromium and its driver on PATH (Debian: apt-get install chromium chromium-driver)")


@pytest.fixture(scope="module")
def window():
    with browser.Browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    return variety(tmp_path_factory.mktemp("page") / "variety.vtkhdf")


@pytest.fixture(scope="module")
def page(verlet, trajectory):
    """The address of a page."""
    told = verlet("view", trajectory, "-o", trajectory.with_suffix(".html")).stdout
    assert "31 frames" in told
    return trajectory.with_suffix(".html").as_uri()


def still(window, page, time=0.25, more=""):
    """Stopped at a time, as it comes: loaded if another page is there."""
    if window.script("return location.href.split('#')[0]") == page:
        window.script("document.activeElement.blur(); location.hash = ''; document.getElementById('home').click();"
                      "location.hash = arguments[0]", f"t={time}{more}")
        window.picture()
    else:
        window.open(f"{page}#t={time}{more}")
    assert window.state("playing") == "false"


def difference(a, b):
    """Part of the pixels that differ visibly, within the ring that marks the focus."""
    return np.mean(np.abs(a - b)[4:-4, 4:-4].max(axis=2) > 12)


def share(pixels, colour):
    """Part of the pixels of the hue of a colour, whatever their brightness."""
    pixels = pixels.reshape(-1, 3) + 1e-9
    hue = pixels / np.linalg.norm(pixels, axis=1, keepdims=True)
    return np.mean(np.linalg.norm(hue - colour / np.linalg.norm(colour), axis=1) < 0.08)


def test_it_plays_by_itself_and_asks_for_nothing(window, page):
    window.requests(), window.log("browser")
    window.open(page)
    assert window.script("return document.getElementById('trouble').hidden")
    frames = {window.state("frame")}
    window.wait(lambda: frames.add(window.state("frame")) or len(frames) > 1)
    assert {url for url in window.requests() if not url.startswith(("data:", "about:"))} == {page}
    complaints = [entry["message"] for entry in window.log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    assert [message for message in complaints if "GPU" not in message] == []


def test_bodies_have_their_colours_and_are_named(window, page):
    still(window, page)
    panels = "for (const each of document.querySelectorAll('header, figure')) each.style.visibility = arguments[0]"
    window.script(panels, "hidden")
    picture = window.picture()
    window.script(panels, "visible")
    for colour in PALETTE[:5]:
        assert share(picture, colour) > 1e-4
    names = window.script("return [...document.querySelectorAll('#bodies li')].map((each) => each.textContent)")
    assert names == ["sheet", "line", "crate × 2", "dots"]


def test_keys(window, page):
    still(window, page, 0.2)
    assert window.state("frame") == "12"
    for keys, frame in ((["right"], "13"), (["left", "left", "left"], "10"), (["end"], "30"), (["right"], "30"), (["home"], "0")):
        window.keys(*keys)
        window.wait(lambda frame=frame: (window.state("frame"), window.state("playing")) == (frame, "false"))
    for playing in ("true", "false"):
        window.keys(" ")
        window.wait(lambda playing=playing: window.state("playing") == playing)
    window.keys("down", "down")
    window.wait(lambda: window.script("return document.getElementById('speed').value") == "0.25")


def test_a_focused_control_keeps_its_own_keys(window, page):
    still(window, page)
    window.script("document.getElementById('play').focus()")
    window.keys(" ")
    window.wait(lambda: window.state("playing") == "true")
    window.picture()
    assert window.state("playing") == "true", "pressed once, not twice"


def test_mouse_and_wheel_move_the_eye_and_r_brings_it_back(window, page):
    still(window, page)
    first = window.picture()
    for move in (lambda: window.drag([(300, 120), (380, 150), (400, 170)]), lambda: window.drag([(300, 120), (360, 120)], button=2),
                 lambda: window.scroll(300, 120, -400), lambda: window.keys("-")):
        before = window.picture()
        move()
        window.wait(lambda before=before: difference(before, window.picture()) > 0.01)
    window.keys("r")
    window.wait(lambda: difference(first, window.picture()) < 1e-3)


def test_two_fingers_zoom_on_a_phone(window, page):
    window.resize(360, 640, mobile=True)
    still(window, page)
    first = window.picture()
    assert first.shape == (640, 360, 3)
    window.drag([(180, 250), (150, 250), (100, 250)], [(220, 250), (250, 250), (300, 250)], kind="touch")
    window.wait(lambda: difference(first, window.picture()) > 0.02)
    assert window.script("return document.documentElement.scrollWidth <= innerWidth")
    window.resize(640, 360)


def test_strain_is_a_switch(window, page):
    still(window, page, 0.4)
    plain = window.picture()
    window.click("#strain")
    window.wait(lambda: difference(plain, window.picture()) > 0.01)
    assert window.script("return !document.getElementById('scale').hidden")
    window.keys("s")
    window.wait(lambda: difference(plain, window.picture()) < 0.003)        # the ring about the switch stays


def test_the_slider_and_the_chart_go_to_a_time(window, page, trajectory):
    still(window, page)
    window.script("const slider = document.getElementById('time'); slider.value = 0.4; slider.dispatchEvent(new Event('input'))")
    window.picture()
    assert window.state("frame") == "24"
    with h5py.File(trajectory) as file:
        energy = file["observables/total_energy/value"][24]
    told = window.script("return document.querySelector('#chart canvas').getAttribute('aria-label')")
    assert f"total {energy:.3g} J" in told
    place = window.script("const box = document.querySelector('#chart canvas').getBoundingClientRect();"
                          "return [Math.round(box.x + 0.5 * box.width), Math.round(box.y + 40)]")
    window.drag([place, place])
    window.wait(lambda: window.state("frame") == "15")


def test_every_control_has_a_name(window, page):
    still(window, page)
    nameless = window.script("""return [...document.querySelectorAll('button, input, select, canvas, [role=img]')].filter((each) =>
        !(each.getAttribute('aria-label') || each.innerText?.trim() || each.closest('label')?.innerText.trim()))
        .map((each) => each.id)""")
    assert nameless == []


def test_how_far_positions_may_be_off_stands_on_the_page(window, page, trajectory):
    still(window, page)
    told = window.script("return document.getElementById('about').textContent")
    error = json.loads(window.script("return document.getElementById('header').textContent"))["error"]
    with h5py.File(trajectory) as file:
        positions = file["particles/trajectory/position/value"][:].astype(float)
    assert error == pytest.approx(np.ptp(positions, axis=(0, 1)).max() / 65535 / 2)
    assert f"within {1e6 * error:.3g} µm" in told


def test_names_are_text_and_nothing_else(window, verlet, tmp_path):
    """A scene's name and its bodies' names cannot bring a script or a tag into the page."""
    evil = "</script><script>document.title='caught'</script><b>&{{data}}"
    scene = {"name": evil, "bodies": [{"kind": "cloth", "name": "sheet"}]}
    path = write(tmp_path / "evil.vtkhdf", np.random.default_rng(1).normal(size=(3, 23, 3)), scene=scene)
    verlet("view", path, "-o", tmp_path / "evil.html")
    window.open((tmp_path / "evil.html").as_uri() + "#t=0")
    assert window.script("return [document.title, document.querySelector('h1').innerText]") == [evil, evil]
