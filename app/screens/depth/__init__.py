"""The Depth screen: sensor depth and inferred depth, compared, aligned and judged."""
