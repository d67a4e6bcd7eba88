"""A lesson of one stop without a fault, which tests change."""

LESSON = """# My radius
screen: surface
scene: office

## One
set: radii = 2 r_F
open: Holes
see: Radius (mm)
Now {missed}.

ask: Which?
choices:
- [ ] Red. | No.
- [x] Blue.
- [ ] Grey. | No.
reveal: So.
"""
TRANSLATION = """# Mein Radius

## Eins
Jetzt {missed}.

ask: Welche?
choices:
- [ ] Rot. | Nein.
- [x] Blau.
- [ ] Grau. | Nein.
reveal: So.
"""
