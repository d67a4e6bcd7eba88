"""Saturated nodes around one sink in ns-3, for comparison with network_sim by ``ns3.py``.

``python ns3_runs.py '[{"mac": "ieee802154", "nodes": 3, "payload_bytes": 116, "radius_m": 10, "seconds": 10,
"seed": 1, "strict": false}]'`` prints JSON: the result of each run, and ns-3's own constants. It needs ns-3's
Python bindings (``pip install ns3``) and nothing else. Frames are counted in C++, so that Python does not
slow ns-3 down.
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import dataclass
from functools import partial

from ns import ns

ROUNDS = 5
START_S = 0.2
"""End of the stations' association, which is neither counted nor timed."""
SPREAD_S = 0.02
"""Time after ``START_S`` within which each node's first packet comes, at random."""
WARM_UP = 0.05
"""Share of the time after ``START_S`` whose packets are not counted, as in network_sim."""
MAX_DELAY_S = 3600.0
"""Longest time of a packet in a buffer; ns-3's default, half a second, is too short with 20 stations."""
PAN = 5
SETTINGS = {
    "WifiMac::MpduBufferSize": ns.UintegerValue(64),
    "WifiMac::BE_MaxAmpduSize": ns.UintegerValue(6_500_631),
    "HeConfiguration::GuardInterval": ns.TimeValue(ns.NanoSeconds(800)),
    "QosTxop::UseExplicitBarAfterMissedBlockAck": ns.BooleanValue(False),
}
"""As in network_sim: the standards' limits of an A-MPDU, the shortest guard interval, and no request for a
block acknowledgement that did not come."""

NODES = r"""
#include <unordered_set>
#include "ns3/lr-wpan-module.h"
#include "ns3/wifi-module.h"
namespace saturated {
using namespace ns3;
using namespace ns3::lrwpan;

struct Tally {
  int64_t from_ns = 0;
  uint64_t arrived = 0, packets = 0, frames = 0;
  uint32_t bytes = 0;
  std::unordered_set<uint64_t> seen;
};
Tally tally;
bool counting() { return Simulator::Now().GetNanoSeconds() >= tally.from_ns; }
void count(uint64_t& number) { if (counting()) number++; }
void start_at(Ptr<NetDevice> device, double s, Callback<void> hand) {
  Simulator::ScheduleWithContext(device->GetNode()->GetId(), Seconds(s), [hand]() { hand(); });
}

// IEEE 802.15.4: the next packet is handed on as soon as the last is confirmed.
void zigbee_hand(Ptr<LrWpanMac> mac, uint16_t pan) {
  McpsDataRequestParams how;
  how.m_dstPanId = pan;
  how.m_dstAddr = Mac16Address("00:01");
  how.m_txOptions = TX_OPTION_ACK;
  mac->McpsDataRequest(how, Create<Packet>(tally.bytes));
}
void zigbee_done(Ptr<LrWpanMac> mac, uint16_t pan, McpsDataConfirmParams) {
  count(tally.packets);
  zigbee_hand(mac, pan);
}
void zigbee_arrived(McpsDataIndicationParams, Ptr<Packet> packet) {
  if (tally.seen.insert(packet->GetUid()).second) count(tally.arrived);  // ns-3 hands up copies, too
}
void zigbee_begin(Ptr<const Packet> packet) {
  if (packet->GetSize() > tally.bytes) count(tally.frames);
}
void zigbee(Ptr<NetDevice> device, uint16_t pan, bool sink, double start_s) {
  auto mac = DynamicCast<LrWpanNetDevice>(device)->GetMac();
  auto phy = DynamicCast<LrWpanNetDevice>(device)->GetPhy();
  phy->TraceConnectWithoutContext("PhyTxBegin", MakeCallback(&zigbee_begin));
  if (sink) { mac->SetMcpsDataIndicationCallback(MakeCallback(&zigbee_arrived)); return; }
  mac->SetMcpsDataConfirmCallback(MakeBoundCallback(&zigbee_done, mac, pan));
  start_at(device, start_s, MakeBoundCallback(&zigbee_hand, mac, pan));
}

// IEEE 802.11: so many packets wait that the next frame is never short of them.
void wifi_hand(Ptr<NetDevice> device, Address sink) {
  device->Send(Create<Packet>(tally.bytes), sink, 0x0800);
}
void wifi_acked(Ptr<NetDevice> device, Address sink, Ptr<const WifiMpdu>) {
  count(tally.packets);
  wifi_hand(device, sink);
}
void wifi_dropped(Ptr<NetDevice> device, Address sink, WifiMacDropReason, Ptr<const WifiMpdu>) {
  count(tally.packets);
  wifi_hand(device, sink);
}
void wifi_begin(Ptr<const Packet> packet, double) {
  if (packet->GetSize() > tally.bytes) count(tally.frames);
}
bool wifi_arrived(Ptr<NetDevice>, Ptr<const Packet>, uint16_t, const Address&) {
  count(tally.arrived);
  return true;
}
void wifi(Ptr<NetDevice> device, Ptr<NetDevice> sink, double start_s, std::string basic, int waiting) {
  auto wifi = DynamicCast<WifiNetDevice>(device);
  wifi->GetRemoteStationManager()->AddBasicMode(WifiMode(basic));
  if (device == sink) { device->SetReceiveCallback(MakeCallback(&wifi_arrived)); return; }
  auto mac = wifi->GetMac();
  Address to = sink->GetAddress();
  mac->TraceConnectWithoutContext("AckedMpdu", MakeBoundCallback(&wifi_acked, device, to));
  mac->TraceConnectWithoutContext("DroppedMpdu", MakeBoundCallback(&wifi_dropped, device, to));
  wifi->GetPhy()->TraceConnectWithoutContext("PhyTxBegin", MakeCallback(&wifi_begin));
  for (int i = 0; i < waiting; i++) start_at(device, start_s, MakeBoundCallback(&wifi_hand, device, to));
}
}
"""


def place(count: int, radius_m: float) -> ns.NodeContainer:
    """Return a sink and ``count`` nodes on a circle around it."""
    nodes, places = ns.NodeContainer(), ns.CreateObject[ns.ListPositionAllocator]()
    nodes.Create(count + 1)
    places.Add(ns.Vector(0.0, 0.0, 0.0))
    for node in range(count):
        angle = 2.0 * math.pi * node / count
        places.Add(ns.Vector(radius_m * math.cos(angle), radius_m * math.sin(angle), 0.0))
    mobility = ns.MobilityHelper()
    mobility.SetPositionAllocator(places)
    mobility.SetMobilityModel("ns3::ConstantPositionMobilityModel")
    mobility.Install(nodes)
    return nodes


def install_802154(
    nodes: ns.NodeContainer, starts_s: list[float], strict: bool
) -> tuple[ns.NetDeviceContainer, ns.LrWpanHelper]:
    """Install unslotted IEEE 802.15.4 with short addresses; ``strict`` has no effect here.

    Returns:
        The devices, and the helper, which owns their channel and must be kept until the end.
    """
    helper = ns.LrWpanHelper()
    devices = helper.Install(nodes)
    helper.CreateAssociatedPan(devices, PAN)
    for node, start_s in enumerate([0.0, *starts_s]):
        ns.cppyy.gbl.saturated.zigbee(devices.Get(node), PAN, node == 0, start_s)
    return devices, helper


@dataclass(frozen=True)
class Wlan:
    """One of the standards of IEEE 802.11, at 2.4 GHz."""

    standard: int
    width_mhz: int
    data: str
    """Rate of data frames."""
    basic: str
    """Rate of answers."""
    waiting: int
    """Packets that wait at each station: the window of the block acknowledgement, twice."""


WLANS = {
    "ieee80211b": Wlan(ns.WIFI_STANDARD_80211b, 22, "DsssRate11Mbps", "DsssRate2Mbps", 2),
    "ieee80211n": Wlan(ns.WIFI_STANDARD_80211n, 20, "HtMcs7", "ErpOfdmRate24Mbps", 128),
    "ieee80211ax": Wlan(ns.WIFI_STANDARD_80211ax, 20, "HeMcs9", "ErpOfdmRate24Mbps", 128),
}


def install_wlan(
    wlan: Wlan, nodes: ns.NodeContainer, starts_s: list[float], strict: bool
) -> tuple[ns.NetDeviceContainer, ns.WifiHelper]:
    """Install IEEE 802.11; with ``strict`` a receiver notices every frame, even among equally strong ones.

    The sink is an access point, because stations of an ad hoc network answer at 11 Mb/s; it beacons once.
    """
    wifi, mac, phy = ns.WifiHelper(), ns.WifiMacHelper(), ns.YansWifiPhyHelper()
    wifi.SetStandard(wlan.standard)
    phy.Set("ChannelSettings", ns.StringValue(f"{{0, {wlan.width_mhz}, BAND_2_4GHZ, 0}}"))
    rates = [ns.StringValue(wlan.data), ns.StringValue(wlan.basic)]
    wifi.SetRemoteStationManager(
        "ns3::ConstantRateWifiManager", "DataMode", rates[0], "ControlMode", rates[1]
    )
    phy.SetChannel(ns.YansWifiChannelHelper.Default().Create())
    if strict:
        phy.DisablePreambleDetectionModel()
    name, yes, no = ns.SsidValue(ns.Ssid("s")), ns.BooleanValue(True), ns.BooleanValue(False)
    minute = ns.TimeValue(ns.MicroSeconds(60_000 * 1024))
    access_point = ("ns3::ApWifiMac", "Ssid", name, "BeaconInterval", minute, "EnableBeaconJitter", no)
    station = ("ns3::StaWifiMac", "Ssid", name, "ActiveProbing", yes)
    devices = ns.NetDeviceContainer()
    for node in range(nodes.GetN()):
        mac.SetType(*(station if node else access_point))
        devices.Add(wifi.Install(phy, mac, nodes.Get(node)))
    for node, start_s in enumerate([0.0, *starts_s]):
        ns.cppyy.gbl.saturated.wifi(devices.Get(node), devices.Get(0), start_s, wlan.basic, wlan.waiting)
    return devices, wifi


def run(
    mac: str, nodes: int, payload_bytes: int, radius_m: float, seconds: float, seed: int, strict: bool
) -> dict:
    """Simulate one scenario; return counts of packets after the warm-up, events, and wall seconds."""
    ns.RngSeedManager.SetSeed(seed)
    ns.cppyy.gbl.saturated.tally = ns.cppyy.gbl.saturated.Tally()
    tally = ns.cppyy.gbl.saturated.tally
    tally.bytes, tally.from_ns = payload_bytes, round(1e9 * (START_S + WARM_UP * seconds))
    draw = ns.CreateObject[ns.UniformRandomVariable]()
    starts_s = [START_S + draw.GetValue(0.0, SPREAD_S) for _ in range(nodes)]
    install = install_802154 if mac == "ieee802154" else partial(install_wlan, WLANS[mac])
    devices, helper = install(place(nodes, radius_m), starts_s, strict)
    ns.Simulator.Stop(ns.Seconds(START_S))
    ns.Simulator.Run()
    before = ns.Simulator.GetEventCount()
    ns.Simulator.Stop(ns.Seconds(seconds))
    started = time.perf_counter()
    ns.Simulator.Run()
    wall_s = time.perf_counter() - started
    events = ns.Simulator.GetEventCount() - before
    ns.Simulator.Destroy()
    del devices, helper
    counts = {key: int(getattr(tally, key)) for key in ("arrived", "packets", "frames")}
    return {**counts, "counted_s": (1.0 - WARM_UP) * seconds, "events": events, "wall_s": wall_s}


def median(runs: list[dict]) -> dict:
    """Return the run with the median time."""
    return sorted(runs, key=lambda one: one["wall_s"])[len(runs) // 2]


def constants_802154() -> dict[str, float]:
    """Return ns-3's constants of IEEE 802.15.4: times in microseconds, and limits."""
    devices, helper = install_802154(place(1, 10.0), [0.0], False)
    mac, csma, symbol_us = devices.Get(1).GetMac(), devices.Get(1).GetCsmaCa(), 16
    limits = csma.GetMacMinBE(), csma.GetMacMaxBE(), csma.GetMacMaxCSMABackoffs(), mac.GetMacMaxFrameRetries()
    min_be, max_be, backoffs, retries = (int(limit) for limit in limits)
    found = {
        "backoff": ns.lrwpan.aUnitBackoffPeriod * symbol_us,
        "turnaround": ns.lrwpan.aTurnaroundTime * symbol_us,
        "ACK wait": mac.GetMacAckWaitDuration() * symbol_us,
        "LIFS": mac.m_macLIFSPeriod * symbol_us,
        "BE at first": min_be,
        "BE at most": max_be,
        "backoffs again": backoffs,
        "retries": retries,
    }
    ns.Simulator.Destroy()
    del helper
    return found


def constants_80211b() -> dict[str, float]:
    """Return ns-3's constants of IEEE 802.11b: times in microseconds, and limits.

    A data frame carries 1000 bytes over UDP.
    """
    devices, _ = install_wlan(WLANS["ieee80211b"], place(1, 10.0), [0.0], False)
    phy, mac = devices.Get(1).GetPhy(), devices.Get(1).GetMac()
    slot_us, sifs_us = (time_.GetNanoSeconds() / 1e3 for time_ in (phy.GetSlot(), phy.GetSifs()))
    vectors = {}
    for rate in ("DsssRate11Mbps", "DsssRate2Mbps"):
        vectors[rate] = ns.WifiTxVector()
        vectors[rate].SetMode(ns.WifiMode(rate))
        vectors[rate].SetPreambleType(ns.WIFI_PREAMBLE_LONG)
    data, ack = (
        ns.WifiPhy.CalculateTxDuration(size, vector, ns.WIFI_PHY_BAND_2_4GHZ).GetNanoSeconds() / 1e3
        for size, vector in zip((1064, 14), vectors.values(), strict=True)
    )
    preamble = ns.WifiPhy.CalculatePhyPreambleAndHeaderDuration(vectors["DsssRate2Mbps"])
    difs_us = sifs_us + int(mac.GetTxop().GetAifsn(0)) * slot_us
    found = {
        "slot": slot_us,
        "SIFS": sifs_us,
        "DIFS": difs_us,
        "EIFS": sifs_us + phy.GetAckTxTime().GetNanoSeconds() / 1e3 + difs_us,
        "data frame": data,
        "ACK": ack,
        "ACK wait": sifs_us + slot_us + preamble.GetNanoSeconds() / 1e3,
        "CW at first": mac.GetTxop().GetMinCw(0),
        "CW at most": mac.GetTxop().GetMaxCw(0),
        "attempts": mac.GetFrameRetryLimit(),
    }
    ns.Simulator.Destroy()
    return found


def main() -> None:
    """Run the scenarios in the argument, ``ROUNDS`` times each, and print those of median time."""
    ns.cppyy.cppdef(NODES)
    ns.Config.SetDefault("ns3::WifiMacQueue::MaxDelay", ns.TimeValue(ns.Seconds(MAX_DELAY_S)))
    for name, value in SETTINGS.items():
        ns.Config.SetDefault(f"ns3::{name}", value)
    runs = [median([run(**scenario) for _ in range(ROUNDS)]) for scenario in json.loads(sys.argv[1])]
    constants = {"ieee802154": constants_802154(), "ieee80211b": constants_80211b()}
    json.dump({"runs": runs, "constants": constants}, sys.stdout)


if __name__ == "__main__":
    main()
