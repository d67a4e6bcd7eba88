"""Bytes of frames and datagrams: those that scapy 2.8 builds of the same fields."""

from __future__ import annotations

from network_sim.export import ieee80211_frames as wlan
from network_sim.export import ieee802154_frames as wpan
from network_sim.export.datagrams import ipv4_datagram, lowpan_datagram, padded
from network_sim.export.radiotap import rate_header

DATA = b"#hello"
DATAGRAM = "4500002200054000401126c20a0000010a000004f0b0f0b0000e15282368656c6c6f"


def test_ieee802154_frames_are_those_of_scapy() -> None:
    # Dot15d4FCS(seqnum=7, ...) / Dot15d4Data(dest_panid=0x504d, dest_addr=4, src_addr=1) / Raw(b"#hello")
    assert wpan.data_frame(1, 4, 7, True, DATA).hex() == "6188074d50040001002368656c6c6fa4cd"
    assert wpan.acknowledgement(7).hex() == "02000707c1"


def test_the_check_sum_is_the_one_of_the_standard() -> None:
    # CRC-16/KERMIT of "123456789" is 0x2189 (the catalogue of CRC algorithms), sent low byte first.
    assert wpan.with_check_sum(b"123456789")[-2:].hex() == "8921"


def test_only_a_frame_that_wants_an_acknowledgement_asks_for_one() -> None:
    asks, does_not = (wpan.data_frame(1, 4, 7, ack, DATA) for ack in (True, False))
    assert asks[0] ^ does_not[0] == 1 << 5
    assert asks[1:-2] == does_not[1:-2]


def test_ieee80211_frames_are_those_of_scapy() -> None:
    one, four = wlan.address(1), wlan.address(4)
    data = wlan.data_frame(one, four, 300, True, 260, wlan.IPV4, bytes.fromhex(DATAGRAM))
    # Dot11FCS(type=2, FCfield="retry", ID=260, SC=300 << 4, ...) / LLC() / SNAP() / IP() / UDP() / Raw()
    assert data.hex() == (
        "0808040102504d00000402504d00000102504dffffffc012aaaa030000000800" + DATAGRAM + "c5a6902d"
    )
    assert wlan.rts(one, four, 1842).hex() == "b400320702504d00000402504d0000018a1c88c2"
    assert wlan.cts(one, 1582).hex() == "c4002e0602504d000001455d5076"
    assert wlan.acknowledgement(one).hex() == "d400000002504d000001f399d2de"


def test_radiotap_says_the_rate_in_half_megabits_and_that_the_check_sum_is_there() -> None:
    assert rate_header(5.5e6).hex() == "00000a0006000000100b"


def test_datagrams_are_those_of_scapy() -> None:
    assert ipv4_datagram(1, 4, 5, DATA).hex() == DATAGRAM
    # 6LoWPAN: dispatch 7e22 (RFC 6282, 3.1.1), both addresses, f300 (4.3.1), and scapy's UDP check sum 0x2e26
    assert lowpan_datagram(1, 4, DATA).hex() == "7e2200010004f3002e26" + DATA.hex()


def test_an_odd_datagram_has_the_check_sum_of_one_more_zero() -> None:
    odd, even = ipv4_datagram(1, 4, 5, b"abc"), ipv4_datagram(1, 4, 5, b"abc\0")
    sums = [int.from_bytes(one[26:28], "big") for one in (odd, even)]
    assert sums[0] - sums[1] == 2  # the length counts twice: in the header and in the pseudo header


def test_text_is_cut_or_filled_to_the_packets_size() -> None:
    assert padded("#node 1", 4) == b"#nod"
    assert padded("#node", 7) == b"#node\0\0"
