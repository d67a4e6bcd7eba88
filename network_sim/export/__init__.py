"""A run for other programs: packet captures (pcap), and scripts for Linux's network emulator (tc netem)."""
