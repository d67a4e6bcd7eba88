"""The Surface screen: a ball rolls over the points; its radius decides where holes stay open."""
