"""Lengths, heights and angles measured in rendered rooms by clicks whose true points are known."""
