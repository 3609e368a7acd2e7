"""WebDataset shards, read back."""

from __future__ import annotations

import json
import tarfile
import tracemalloc
from pathlib import Path

import numpy as np
import raycam
from raycam.dataset import write
from support.box_table import ring, table, truth


def test_webdataset_shards_contain_the_samples(tmp_path: Path) -> None:
    cameras = ring(5)
    write(table(), tmp_path, "webdataset", cameras=cameras, shard_size=2, channels=["depth", "normal"])
    index = json.loads((tmp_path / "index.json").read_text())
    assert [shard["nsamples"] for shard in index["shardlist"]] == [2, 2, 1]
    samples: dict[str, dict[str, bytes]] = {}
    for shard in index["shardlist"]:
        with tarfile.open(tmp_path / shard["url"]) as tar:
            for member in tar:
                key, _, ending = member.name.partition(".")
                samples.setdefault(key, {})[ending] = tar.extractfile(member).read()
    assert sorted(samples) == [f"{i:06d}" for i in range(5)]
    for camera, (_, sample) in zip(cameras, sorted(samples.items()), strict=True):
        import io

        assert set(sample) == {"png", "json", "depth.npy", "normal.npy"}
        np.testing.assert_array_equal(np.load(io.BytesIO(sample["depth.npy"])), truth(camera, "depth"))
        described = json.loads(sample["json"])
        again = raycam.Camera(described["K"], described["R"], described["C"], described["size"])
        np.testing.assert_array_equal(again.P, camera.P)
        assert described["categories"] == {"1": "box", "2": "ball", "9": "9"}


def test_webdataset_memory_does_not_grow_with_the_shard(tmp_path: Path) -> None:
    channels = ["depth", "position", "normal", "normal_camera", "shading_normal", "barycentric", "uv"]
    peaks, sizes = [], []
    for count in (4, 64):
        given = {"cameras": ring(count), "shard_size": count, "channels": channels, "samples": 1}
        tracemalloc.start()
        write(table(), tmp_path / f"{count}", "webdataset", **given)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        sizes.append((tmp_path / f"{count}" / "shard-000000.tar").stat().st_size)
    assert peaks[1] - peaks[0] < (sizes[1] - sizes[0]) / 8
