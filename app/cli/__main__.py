"""``python -m app.cli``, the same as ``packetmesh``."""

from app.cli import main

main()
