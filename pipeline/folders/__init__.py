"""What commands leave on disk: a reconstruction, a delivery, a registered pair."""
