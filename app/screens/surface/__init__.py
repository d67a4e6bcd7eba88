"""The Surface screen: a ball rolls over the points; its radius decides which gaps become holes."""
