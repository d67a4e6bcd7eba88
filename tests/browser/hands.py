"""What a hand and an eye do with the app: go to a step, move a slider, look at the 3-D picture."""

from __future__ import annotations

import contextlib
import re

import cv2
import numpy as np
from playwright.sync_api import TimeoutError

PATIENCE_MS = 200_000
"""How long a page may take to show what it was asked for, on a slow machine that does other things, too."""
DRAG_S = 500.0
"""How long a hand may have to drag a slider until enough has been drawn there."""
TRIES, TRY_MS = 12, 5000
STEPS = ("Scene", "Calibrate", "Depth", "Fuse", "Surface", "Network", "Export")
TEXTS = {
    "Scene": "Each camera node delivers",
    "Calibrate": "Photographs of a board of known size",
    "Depth": "points that the sensor measured",
    "Fuse": "Each lane registers the same cloud",
    "Surface": "A ball rolls over the points",
    "Network": "by radio, packet by packet",
    "Export": "Download the results",
}


def go(page, step):
    page.get_by_role("button", name=re.compile(f"^{step}( .)?$")).click()
    page.get_by_text(TEXTS[step]).wait_for()


CELL_PX, LEVELS = 16, 15
"""Pictures are compared by the mean colours of such cells: where drawing is slow, viser lowers the
resolution of its canvas as it goes, which no eye would call another picture."""
ALIKE = 0.02
"""Share of cells that may differ, by so many levels, between two pictures of the same thing."""
UNCOVERED = ".mantine-Notifications-root, .packetmesh-notice, [role=tooltip] { display: none !important }"


DRAW = """patience_ms => {
  [window.drew, window.draws] = [false, true];
  const end = performance.now() + patience_ms; // an empty scene has nothing to draw
  return new Promise(done => {
    const look = () => {
      if (!window.drew && performance.now() < end) return void setTimeout(look, 20);
      requestAnimationFrame(() => requestAnimationFrame(() => done(window.drew)));
    };
    look();
  });
}"""


def canvas(page, still=2):
    """The 3-D picture once `still` looks at it in a row are the same, without what pops up over it.

    For each look it is drawn anew; no more frames are drawn while the picture is taken, which takes seconds.
    """
    last, same, patience_ms = b"", 1, 5000
    for _ in range(40):
        page.wait_for_timeout(200)
        with drawn(page, patience_ms) as drew:
            page.evaluate("() => { window.rests = true; }")
            picture = page.locator("canvas").first.screenshot(style=UNCOVERED)
        same = same + 1 if picture == last else 1
        if same == still:
            break
        last, patience_ms = picture, 5000 if drew else 500
    return picture


@contextlib.contextmanager
def drawn(page, patience_ms=5000):
    """The page draws its 3-D picture meanwhile, from the next frame on. Yields whether there was anything."""
    drew = page.evaluate(DRAW, patience_ms)
    try:
        yield drew
    finally:
        page.evaluate("() => { window.draws = false; window.goOn?.(); }")


def differing(one, other):
    """Share of the cells in which two pictures differ visibly, as far down as both reach."""
    pictures = [cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR) for png in (one, other)]
    height, width = np.min([picture.shape[:2] for picture in pictures], axis=0)
    cells = []
    for picture in pictures:
        size = (width // CELL_PX, height // CELL_PX)
        cells.append(cv2.resize(picture[:height, :width], size, interpolation=cv2.INTER_AREA))
    return float(np.mean(cv2.absdiff(*cells).max(axis=2) > LEVELS))


def changed_from(page, picture):
    """Whether the 3-D picture becomes another one within ten seconds."""
    return any(differing(canvas(page), picture) > ALIKE for _ in range(25))


def slider(page, label):
    identity = page.locator("label", has_text=label).first.get_attribute("for")
    return page.locator(f'[id="{identity}"] [role=slider]')


def unfold(page, folder):
    page.get_by_text(folder, exact=True).last.click()
    page.wait_for_timeout(400)


def visible(page, label):
    """The input of that label on the step that is shown."""
    return page.get_by_label(label, exact=True).locator("visible=true").first


def pick(page, label, option):
    """Open a list and take an option, again if what draws the panel anew has closed the list."""
    entry = page.get_by_role("option", name=option, exact=True).locator("visible=true")
    for _ in range(TRIES):
        visible(page, label).click()
        try:
            return entry.click(timeout=TRY_MS)
        except TimeoutError:
            continue
    raise AssertionError(f"{option} is never offered under {label}")


def press(page, name):
    page.get_by_role("button", name=name, exact=True).last.click()


def arrow(page):
    """The middle of the red arrow of some transform controls, in the page's pixels."""
    box = page.locator("canvas").first.bounding_box()
    picture = cv2.imdecode(np.frombuffer(canvas(page), np.uint8), cv2.IMREAD_COLOR).astype(int)
    blue, green, red = np.moveaxis(picture, 2, 0)
    y, x = np.nonzero((red > 180) & (red - green > 100) & (blue > green) & (blue < 160))
    assert len(x) > 20
    return box["x"] + float(np.median(x)), box["y"] + float(np.median(y))


NEW_SESSION = """query => {
  sessionStorage.clear();
  history.replaceState(null, "", `${location.pathname}?${query}`);
  const {beginAddress, showAddress} = packetmesh.calls;
  packetmesh.calls.showAddress = () => {}; // of the old session, still on its way
  window.begun = new Promise(done => {
    packetmesh.calls.beginAddress = (...given) => {
      Object.assign(packetmesh.calls, {beginAddress, showAddress});
      beginAddress(...given);
      done();
    };
  });
  connection.onmessage({data: {type: "closed", closeReason: ""}}); // what viser hears when the server is gone
  return window.begun;
}"""


def afresh(page, query="fixedDpr=1"):
    """Give the page a new session, as a new browser has it: nothing of before in the address, no folder left
    open. The page connects again as after a restart of the server, which takes a third of loading it.
    """
    page.evaluate(NEW_SESSION, query)
    page.get_by_text("Up to date").wait_for()
    dismiss_notifications(page)


def dismiss_notifications(page):
    """Close whatever is in the corner."""
    close = "document.querySelectorAll('.mantine-Notification-closeButton').forEach(one => one.click())"
    page.evaluate(close)  # one that goes by itself meanwhile is no longer there to be clicked
    page.wait_for_timeout(400)
