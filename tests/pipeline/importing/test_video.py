"""Images of video files in any order and from several threads."""

from concurrent.futures import ThreadPoolExecutor

import av
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.importing.video import KEPT, NEAR, TrackReader, contents_of
from tests.pipeline.strangers.containers import jpeg, write_matroska, write_video

COUNT = 3 * NEAR


@pytest.fixture(scope="module")
def matroska(tmp_path_factory):
    """Depth of the number of the image, and photographs of 8 x 16 pixels."""
    file = tmp_path_factory.mktemp("video") / "room.mkv"
    depth = [np.full((16, 16), 1000 + k, np.uint16) for k in range(COUNT)]
    photo = jpeg(np.zeros((16, 8, 3), np.uint8))
    write_matroska(file, {}, [photo] * COUNT, depth, (8, 16))
    return file


def depth_reader(file):
    tracks = {track.title: track for track in contents_of(file).tracks}
    return TrackReader(file, (tracks["COLOR"], tracks["DEPTH"]), decoded=False), tracks["DEPTH"]


def number_in(packet):
    return int(np.frombuffer(packet, ">u2")[0]) - 1000


def test_contents_are_tracks_times_and_attachments(matroska):
    contents = contents_of(matroska)
    assert [track.title for track in contents.tracks] == ["COLOR", "DEPTH", "IR"]
    depth = contents.tracks[1]
    assert (depth.tag, depth.width_px, depth.height_px) == ("b16g", 16, 16)
    np.testing.assert_allclose(depth.times_s, 0.033 * np.arange(COUNT) + 0.001)
    assert contents.attachments["calibration.json"].rstrip(b"\0") == b"{}"


def test_packets_are_read_in_any_order(matroska):
    reader, track = depth_reader(matroska)
    rng = np.random.default_rng(3)
    for k in [*range(5), COUNT - 1, 0, *rng.integers(0, COUNT, 60).tolist(), COUNT - 1, COUNT - 2]:
        assert number_in(reader.packet(track, k)) == k


def test_reading_on_does_not_begin_again(matroska, monkeypatch):
    reader, track = depth_reader(matroska)
    begun = []
    whole = TrackReader._from
    monkeypatch.setattr(TrackReader, "_from", lambda *args: begun.append(args[2]) or whole(*args))
    for k in range(0, COUNT, 3):
        reader.packet(track, k)
    assert len(begun) == 1
    assert all(len(kept) <= KEPT for kept in reader._kept.values())


def test_threads_share_a_reader(matroska):
    reader, track = depth_reader(matroska)
    numbers = np.random.default_rng(4).integers(0, COUNT, 120).tolist()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: number_in(reader.packet(track, k)), numbers))
    assert found == numbers


def test_a_file_that_became_shorter_gets_a_sentence_and_is_read_again_before_it(matroska, tmp_path):
    file = tmp_path / "room.mkv"
    file.write_bytes(matroska.read_bytes())
    reader, track = depth_reader(file)
    file.write_bytes(matroska.read_bytes()[: matroska.stat().st_size // 2])
    with pytest.raises(InputError, match=rf"Image {COUNT - 1} of .*room.mkv is truncated or damaged"):
        reader.packet(track, COUNT - 1)
    assert number_in(reader.packet(track, 7)) == 7


def test_frames_of_a_film_are_decoded_from_the_last_whole_one(tmp_path):
    file = tmp_path / "rgb.mp4"
    write_video(file, [np.full((32, 48, 3), k, np.uint8) for k in range(0, 200, 2)])
    (track,) = contents_of(file).tracks
    assert len(track.stamps) == 100
    assert 5 < len(track.jumps) < 20
    reader = TrackReader(file, (track,), decoded=True)
    for k in (0, 99, 50, 51, 13, 12, 98):
        frame = reader.frame(track, k)
        assert frame.shape == (32, 48, 3)
        assert np.abs(frame.astype(int) - 2 * k).max() <= 3


def test_images_before_the_cut_of_a_film_are_no_frames(tmp_path):
    """A film that was cut without encoding it again begins at a whole image, and its edit list at the cut."""
    whole, cut = tmp_path / "whole.mp4", tmp_path / "rgb.mp4"
    write_video(whole, [np.full((32, 48, 3), k, np.uint8) for k in range(0, 200, 2)])
    with av.open(str(whole)) as source, av.open(str(cut), "w") as target:
        film = source.streams.video[0]
        stamps = contents_of(whole).tracks[0].stamps
        first, begin = stamps[24], stamps[30]  # 24 and 36 are whole images
        copied = target.add_stream_from_template(film)
        for packet in source.demux(film):
            if packet.size and packet.pts >= first:
                packet.stream, packet.pts, packet.dts = copied, packet.pts - begin, packet.dts - begin
                target.mux(packet)
    (track,) = contents_of(cut).tracks
    assert len(track.stamps) == 70
    reader = TrackReader(cut, (track,), decoded=True)
    for k in (0, 5, 69, 40):
        assert np.abs(reader.frame(track, k).astype(int) - 2 * (30 + k)).max() <= 3
