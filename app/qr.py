"""An address as a picture that a phone's camera reads."""

from __future__ import annotations

import base64

import cv2

SIDE_PX = 360


def qr_html(text: str) -> str:
    """An image of the text as a QR code, with a quiet zone of four modules (two are the encoder's)."""
    modules = cv2.QRCodeEncoder.create().encode(text)
    quiet = cv2.copyMakeBorder(modules, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255,))
    png = cv2.imencode(".png", cv2.resize(quiet, None, fx=8, fy=8, interpolation=cv2.INTER_NEAREST))[1]
    data = base64.b64encode(png.tobytes()).decode()
    return f'<img alt="QR code of {text}" width="{SIDE_PX}" src="data:image/png;base64,{data}">'
