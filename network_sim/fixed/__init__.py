"""Fixed cameras around one sink: nodes, routes, images, sink and uplink."""
