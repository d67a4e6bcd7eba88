"""Surface: a ball rolls over the points; its radius decides what becomes a surface and what a hole."""
