"""An address as a picture that a phone's camera reads."""

from __future__ import annotations

import base64

import cv2

from app.web.markup import Markup
from pipeline.types import ByteArray

SIDE_PX = 360
PX_PER_MODULE = 8


def modules_of(text: str) -> ByteArray:
    """(N, N) the text as a QR code, 0 for dark, with a quiet zone of four modules."""
    encoded = cv2.QRCodeEncoder.create().encode(text)  # with two
    return cv2.copyMakeBorder(encoded, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255,))


def qr_html(text: str) -> Markup:
    """An image of the text as a QR code."""
    modules = modules_of(text)
    picture = cv2.resize(modules, None, fx=PX_PER_MODULE, fy=PX_PER_MODULE, interpolation=cv2.INTER_NEAREST)
    data = base64.b64encode(cv2.imencode(".png", picture)[1].tobytes()).decode()
    return Markup('<img alt="QR code of {}" width="{}" src="data:image/png;base64,{}">').format(
        text, SIDE_PX, data
    )
