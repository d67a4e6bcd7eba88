"""From RGB-D images to a surface: arrays in, frozen records out; knows neither the app nor the network."""
