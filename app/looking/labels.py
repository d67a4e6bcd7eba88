"""Texts of the folder *Look*."""

from __future__ import annotations

from app.looking.room import Room
from app.web.markup import Markdown

NOTHING, TOP, PLANE, BOX = "Nothing", "The ceiling", "Behind a plane", "Around a box"
CUTS = (NOTHING, TOP, PLANE, BOX)
USUAL, WIRE, LIT = "As usual", "Wireframe", "Light by hand"
DRAWN = (USUAL, WIRE, LIT)
X, Y, LEVEL, VIEW, FLIP = "x", "y", "Level", "View", "Flip"
TEXT = Markdown(
    "This changes only the view and pictures of it: measures and all other files have the whole scene."
)
HINTS = {
    "cut": "What is cut away from the picture. Drag the arrows and rings in the picture to move the cut.",
    "height": "What is above this height is cut away.",
    "plane": "Turn the plane: across the x or y axis, level, or across the view, with its front cut "
    "away. Flip keeps the other side.",
    "turn": "Turn of the box about the vertical.",
    "inside": "Cut away what is in the box, and keep what is around it.",
    "draw": "Wireframe: the edges of the triangles. Light by hand: surfaces in the light of a lamp; a "
    "photograph's own light stays in its colours.",
    "light": "Where the light comes from: the direction seen from above, from the x axis towards the y axis, "
    "and the height above the horizon.",
    "points": "Diameter of all points; 0 leaves them as they are.",
    "ruler": "A scale bar, valid at the distance of the point about which the view turns, and the directions "
    "of the world's axes. Lengths are the reconstruction's own, without a scale set under Measure.",
}


def top_text(room: Room | None) -> Markdown:
    """Return a note on the ceiling, or the reason why none is known."""
    if room is None:
        return Markdown("There is nothing to look at yet.")
    if not room.upright:
        return Markdown(
            "Which way is up is not known: this camera's pose is unknown, and its picture is taken to be "
            "upright. Lower the height, or choose **{}** and turn the plane."
        ).format(PLANE)
    if room.ceiling_m is None:
        return Markdown(
            "The cameras saw no ceiling: above them is no level surface of 1 m² or more. Lower the height "
            "to cut off more."
        )
    return Markdown("The cameras saw a ceiling; the cut starts 10 cm below it.")
