"""TIFF files, compared with tifffile (with imagecodecs) and Pillow."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
import tifffile
from PIL import Image
from support.raises import raises
from support.texels import albedo_of, linear_from_srgb

COLUMNS, ROWS = 13, 9
COLORS = {"minisblack": 1, "miniswhite": 1, "rgb": 3, "separated": 4}
REVERSED = np.array([int(f"{i:08b}"[::-1], 2) for i in range(256)], np.uint8)
FOUR_ALPHAS = {"unassalpha": 0.4, "assocalpha": 0.4, "unspecified": None}


def samples(dtype: str, channels: int, bits: int | None = None) -> npt.NDArray[Any]:
    """Samples [9, 13, channels] over the whole range of a dtype, or of `bits`."""
    rng = np.random.default_rng([channels, np.dtype(dtype).itemsize, bits or 0])
    shape = (ROWS, COLUMNS, channels)
    if np.dtype(dtype).kind == "f":
        return rng.random(shape).astype(dtype)
    info = np.iinfo(dtype)
    low, high = (0, 2**bits - 1) if bits else (info.min, info.max)
    array = rng.integers(low, high, shape, dtype, endpoint=True)
    array[0, 0], array[0, 1] = low, high
    return array


def unit(array: npt.NDArray[Any], bits: int | None = None) -> npt.NDArray[np.float64]:
    """The values scaled to 0..1; negative values become 0."""
    if array.dtype.kind == "f":
        return array.astype(np.float64)
    largest = 2**bits - 1 if bits else np.iinfo(array.dtype).max
    return np.maximum(array.astype(np.float64) / largest, 0)


def colors(array: npt.NDArray[Any], photometric: str, bits: int | None = None) -> npt.NDArray[np.float64]:
    """The linear colours of samples [9, 13, channels]."""
    values = unit(array, bits)
    count = COLORS[photometric]
    if photometric == "separated":
        values = (1 - values[..., :3]) * (1 - values[..., 3:4])
    elif photometric == "miniswhite":
        values = 1 - values[..., :1]
    values = np.broadcast_to(values[..., : 3 if count > 1 else 1], (ROWS, COLUMNS, 3))
    if array.dtype.kind == "f":
        return values
    if (bits or 8 * array.itemsize) <= 8 and array.dtype.kind == "u":
        values = np.round(255 * values) / 255
    return linear_from_srgb(values)


def write(path: Path, array: npt.NDArray[Any], photometric: str, **options: Any) -> npt.NDArray[Any]:
    """Writes samples [9, 13, channels] with tifffile; returns what tifffile reads."""
    stored = array[..., 0] if array.shape[-1] == 1 else array
    if options.get("planarconfig") == "separate":
        stored = np.moveaxis(array, -1, 0)
    tifffile.imwrite(path, stored, photometric=photometric, metadata=None, **options)
    read = tifffile.imread(path)
    if options.get("planarconfig") == "separate":
        read = np.moveaxis(read, 0, -1)
    return read.reshape(array.shape)


def check(path: Path, expected: npt.NDArray[np.float64], tolerance: float = 3e-5) -> list[str]:
    """Compares a file's linear colours with the expected ones; returns the codes of the notices."""
    found, notices = albedo_of(path, (COLUMNS, ROWS))
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance, err_msg=path.name)
    return sorted({notice.code for notice in notices})


@pytest.mark.parametrize("photometric", COLORS)
@pytest.mark.parametrize("dtype", ["u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8"])
def test_whole_byte_samples_equal_tifffile(tmp_path: Path, dtype: str, photometric: str) -> None:
    kind = np.dtype(dtype).kind
    predictors = [3] if kind == "f" else [2] if dtype[1] != "8" else []
    compressions = [(None, 1), ("lzw", 1), ("zlib", 1), ("zstd", 1)]
    compressions += [(name, predictor) for name in ("lzw", "zlib", "zstd") for predictor in predictors]
    planes = ["contig", "separate"] if COLORS[photometric] > 1 else [None]
    expected = ["approximated_value"] if photometric == "separated" else []
    expected += ["clamped_value"] if kind == "i" else []
    for number, (planar, (compression, predictor)) in enumerate(itertools.product(planes, compressions)):
        byteorder, tile = "<>"[number % 2], (None, (16, 16))[number // 2 % 2]
        options: dict[str, Any] = {"compression": compression, "tile": tile, "byteorder": byteorder}
        options |= {"predictor": predictor} if predictor > 1 else {}
        options |= {"planarconfig": planar} if planar else {}
        path = tmp_path / f"{planar}-{compression}-{predictor}-{byteorder}-{tile}.tif"
        array = write(path, samples(dtype, COLORS[photometric]), photometric, **options)
        assert check(path, colors(array, photometric)) == expected, path.name


@pytest.mark.parametrize("bits", [*range(1, 8), *range(9, 16)])
def test_packed_samples_equal_tifffile(tmp_path: Path, bits: int) -> None:
    dtype = "u1" if bits < 8 else "u2"
    for photometric, planar in [
        ("minisblack", "contig"),
        ("miniswhite", "contig"),
        ("rgb", "contig"),
        ("rgb", "separate"),
    ]:
        for compression in (None, "zlib", "packbits"):
            array = samples(dtype, COLORS[photometric], bits)
            options: dict[str, Any] = {"compression": compression, "rowsperstrip": 4}
            if photometric == "rgb":
                options["planarconfig"] = planar
            path = tmp_path / f"{photometric}-{planar}-{compression}.tif"
            path.write_bytes(packed_file(array, bits, photometric, planar == "separate", compression))
            read = tifffile.imread(path)
            read = np.moveaxis(read, 0, -1) if planar == "separate" else read
            np.testing.assert_array_equal(read.reshape(array.shape), array)
            assert check(path, colors(array, photometric, bits)) == []


def packed_file(
    array: npt.NDArray[Any], bits: int, photometric: str, separate: bool, compression: str | None
) -> bytes:
    """A TIFF file with one strip per plane, whose rows are packed with the highest bit first."""
    import imagecodecs

    planes = [array[..., i : i + 1] for i in range(array.shape[-1])] if separate else [array]
    encode = {None: bytes, "zlib": imagecodecs.zlib_encode, "packbits": imagecodecs.packbits_encode}[
        compression
    ]
    strips = []
    for plane in planes:
        rows = plane.reshape(ROWS, -1)
        flags = (rows[..., None] >> np.arange(bits - 1, -1, -1, dtype=rows.dtype)) & 1
        strips.append(encode(np.packbits(flags.reshape(ROWS, -1), axis=1).tobytes()))
    channels = array.shape[-1]
    tags = {
        256: [COLUMNS],
        257: [ROWS],
        258: [bits] * channels,
        259: [{None: 1, "zlib": 8, "packbits": 32773}[compression]],
        262: [{"miniswhite": 0, "minisblack": 1, "rgb": 2}[photometric]],
        277: [channels],
        278: [ROWS],
        284: [2 if separate else 1],
    }
    return tiff_file(tags, strips)


def tiff_file(tags: dict[int, list[int]], strips: list[bytes]) -> bytes:
    """A little-endian TIFF file with these tags and strips."""
    data, offsets = b"", []
    for strip in strips:
        offsets.append(8 + len(data))
        data += strip + b"\0" * (len(strip) % 2)
    tags = tags | {273: offsets, 279: [len(strip) for strip in strips]}
    start = 8 + len(data)
    values, entries = b"", b""
    after = start + 2 + 12 * len(tags) + 4
    for tag in sorted(tags):
        packed = struct.pack(f"<{len(tags[tag])}I", *tags[tag])
        place = packed if len(packed) <= 4 else struct.pack("<I", after + len(values))
        values += packed if len(packed) > 4 else b""
        entries += struct.pack("<HHI", tag, 4, len(tags[tag])) + place
    return (
        b"II*\0"
        + struct.pack("<I", start)
        + data
        + struct.pack("<H", len(tags))
        + entries
        + b"\0" * 4
        + values
    )


@pytest.mark.parametrize("compression", [None, "lzw", "zlib", "packbits", "zstd"])
@pytest.mark.parametrize("dtype", ["u1", "u2"])
def test_reversed_bits_equal_tifffile(tmp_path: Path, dtype: str, compression: str | None) -> None:
    array = samples(dtype, 3)
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, photometric="rgb", metadata=None, compression=compression)
    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        assert isinstance(page, tifffile.TiffPage)
        tags = {tag: [int(page.tags[tag].value)] for tag in (256, 257, 259, 277, 278)}
        parts = zip(page.dataoffsets, page.databytecounts, strict=True)
    content = np.frombuffer(path.read_bytes(), np.uint8)
    strips = [REVERSED[content[start : start + length]].tobytes() for start, length in parts]
    bits = 8 * array.itemsize
    path.write_bytes(tiff_file(tags | {258: [bits] * 3, 262: [2], 266: [2]}, strips))
    np.testing.assert_array_equal(tifffile.imread(path), array)
    assert check(path, colors(array, "rgb")) == []


@pytest.mark.parametrize("bits", [1, 2, 4, 8, 16])
def test_palettes_equal_tifffile(tmp_path: Path, bits: int) -> None:
    rng = np.random.default_rng(bits)
    palette = rng.integers(0, 65535, (3, 2**bits), "u2", endpoint=True)
    array = samples("u1" if bits <= 8 else "u2", 1, bits)
    tags = {256: [COLUMNS], 257: [ROWS], 258: [bits], 262: [3], 277: [1], 278: [ROWS]}
    flags = (array.reshape(ROWS, -1)[..., None] >> np.arange(bits - 1, -1, -1, dtype=array.dtype)) & 1
    strip = np.packbits(flags.reshape(ROWS, -1), axis=1)
    if bits == 16:
        strip = array.astype("<u2")
    (tmp_path / "a.tif").write_bytes(tiff_file(tags | {320: palette.ravel().tolist()}, [strip.tobytes()]))
    judge = tifffile.TiffFile(tmp_path / "a.tif").asrgb() if hasattr(tifffile.TiffFile, "asrgb") else None
    assert judge is None or judge.shape[:2] == (ROWS, COLUMNS)
    expected = np.moveaxis(palette, 0, -1)[array[..., 0]] >> 8
    assert check(tmp_path / "a.tif", linear_from_srgb(expected / 255)) == []


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "RGBX", "CMYK", "YCbCr", "I;16", "F"])
@pytest.mark.parametrize(
    "compression",
    ["raw", "tiff_lzw", "tiff_adobe_deflate", "tiff_deflate", "packbits", "zstd", "jpeg", "group4", "webp"],
)
def test_files_written_by_pillow_equal_pillow(tmp_path: Path, mode: str, compression: str) -> None:
    smooth = np.add.outer(np.arange(ROWS) * 20, np.arange(COLUMNS) * 7)[..., None] + [0, 9, 30, 60]
    picture = Image.fromarray(smooth.astype(np.uint8), "RGBA")
    if mode in ("I;16", "F"):
        grey = smooth[..., 0]
        picture = Image.fromarray(
            (grey * 256).astype(np.uint16) if mode == "I;16" else (grey / 255).astype(np.float32)
        )
    elif mode == "RGBX":
        picture = Image.frombytes("RGBX", (COLUMNS, ROWS), picture.tobytes())
    else:
        picture = picture.convert("RGB").convert(mode) if mode != "RGBA" else picture
    path = tmp_path / "a.tif"
    try:
        picture.save(path, compression=compression)
        with Image.open(path) as image:
            read = image.copy()
            shown = image.convert("RGB") if image.mode not in ("I;16", "F", "CMYK") else image.copy()
    except (OSError, RuntimeError, ValueError):
        # Pillow cannot write this combination.
        return
    if read.mode == "F":
        expected = np.repeat(np.asarray(read)[..., None], 3, axis=-1)
    elif read.mode == "I;16":
        expected = linear_from_srgb(np.repeat(np.asarray(read)[..., None] / 65535, 3, axis=-1))
    elif read.mode == "CMYK":
        inks = np.asarray(read) / 255
        expected = linear_from_srgb(np.round(255 * (1 - inks[..., :3]) * (1 - inks[..., 3:])) / 255)
    else:
        expected = linear_from_srgb(np.asarray(shown) / 255)
    if (mode, compression) == ("LA", "jpeg"):
        with raises(raycam.FormatError, code="unsupported_feature", mentions=["2 channels"]):
            albedo_of(path, (COLUMNS, ROWS))
        return
    lossy = compression in ("jpeg", "webp") or mode == "YCbCr"
    check(path, expected, tolerance=0.02 if lossy else 2e-5)


@pytest.mark.parametrize("subsampling", [(1, 1), (2, 1), (2, 2), (4, 4)])
def test_subsampled_chroma_equals_pillow(tmp_path: Path, subsampling: tuple[int, int]) -> None:
    """Blocks of luma with one chroma sample each (TIFF 6.0, section 21)."""
    across, down = subsampling
    rng = np.random.default_rng(across + 10 * down)
    blocks = [-(-COLUMNS // across), -(-ROWS // down)]
    luma = rng.integers(60, 200, (blocks[1] * down, blocks[0] * across), "u1")
    chroma = rng.integers(100, 156, (blocks[1], blocks[0], 2), "u1")
    units = luma.reshape(blocks[1], down, blocks[0], across).swapaxes(1, 2).reshape(blocks[1], blocks[0], -1)
    strip = np.concatenate([units, chroma], axis=-1).tobytes()
    tags = {256: [COLUMNS], 257: [ROWS], 258: [8, 8, 8], 259: [1], 262: [6], 277: [3], 278: [ROWS]}
    path = tmp_path / "a.tif"
    path.write_bytes(tiff_file(tags | {530: [across, down]}, [strip]))
    whole = chroma.repeat(down, 0).repeat(across, 1)[:ROWS, :COLUMNS]
    pixels = np.dstack([luma[:ROWS, :COLUMNS], whole])
    expected = np.asarray(Image.fromarray(pixels, "YCbCr").convert("RGB"))
    found, _ = albedo_of(path, (COLUMNS, ROWS))
    srgb = np.round(255 * np.where(found <= 0.0031308, 12.92 * found, 1.055 * found ** (1 / 2.4) - 0.055))
    assert np.abs(srgb - expected).max() <= 1


@pytest.mark.parametrize("dtype", ["u1", "u2", "f4"])
@pytest.mark.parametrize("photometric", ["minisblack", "rgb"])
@pytest.mark.parametrize("planar", ["contig", "separate"])
@pytest.mark.parametrize("kind", FOUR_ALPHAS)
def test_extra_channels_follow_the_extrasamples_tag(
    tmp_path: Path, kind: str, planar: str, photometric: str, dtype: str
) -> None:
    array = samples(dtype, COLORS[photometric] + 1)
    array[..., -1] = 0.41 if dtype == "f4" else {"u1": 103, "u2": 26471}.get(dtype, 0)
    array[..., :-1] = array[..., :-1] * 0.4
    alpha = unit(array[..., -1:])
    path = tmp_path / "a.tif"
    read = write(
        path,
        array,
        photometric,
        planarconfig=planar,
        extrasamples=[kind],
        compression="zlib",
        predictor=2 if dtype != "f4" else 3,
    )
    values = unit(read)[..., :-1]
    values = values / alpha if kind == "assocalpha" else values
    values = np.broadcast_to(np.clip(values, 0, 1), (ROWS, COLUMNS, 3))
    if dtype == "u1":
        values = np.round(255 * values) / 255
    codes = check(path, values if dtype == "f4" else linear_from_srgb(values), tolerance=3e-5)
    assert codes == (["ignored_feature"] if kind == "unspecified" else [])


def test_first_page_of_bigtiff_and_multi_page_files_is_shown(tmp_path: Path) -> None:
    array = samples("u1", 3)
    with tifffile.TiffWriter(tmp_path / "a.tif", bigtiff=True) as file:
        file.write(array, photometric="rgb")
        file.write(255 - array, photometric="rgb")
    check(tmp_path / "a.tif", colors(array, "rgb"))


@pytest.mark.parametrize(
    ("changes", "facts"),
    [
        ({259: [34712]}, [34712]),
        ({259: [34925]}, [34925]),
        ({259: [6]}, [6]),
        ({262: [8]}, ["PhotometricInterpretation", 8]),
        ({258: [24]}, [24]),
        ({339: [6]}, ["SampleFormat"]),
        ({317: [7], 259: [8]}, [7]),
    ],
)
def test_error_names_the_unsupported_tiff_feature(
    tmp_path: Path, changes: dict[int, list[int]], facts: list[int | str]
) -> None:
    tags = {256: [COLUMNS], 257: [ROWS], 258: [8], 259: [1], 262: [1], 277: [1], 278: [ROWS]}
    (tmp_path / "a.tif").write_bytes(tiff_file(tags | changes, [bytes(COLUMNS * ROWS)]))
    with raises(raycam.FormatError, code="unsupported_feature", mentions=facts):
        albedo_of(tmp_path / "a.tif", (COLUMNS, ROWS))


def test_every_truncation_of_a_file_is_refused(tmp_path: Path) -> None:
    array = samples("u2", 3)
    for compression in (None, "lzw", "zstd"):
        write(
            tmp_path / "a.tif",
            array,
            "rgb",
            compression=compression,
            predictor=2 if compression == "lzw" else None,
        )
        whole = (tmp_path / "a.tif").read_bytes()
        for length in range(4, len(whole) - 1, 7):
            (tmp_path / "a.tif").write_bytes(whole[:length])
            try:
                found, _ = albedo_of(tmp_path / "a.tif", (COLUMNS, ROWS))
            except raycam.FormatError:
                continue
            np.testing.assert_allclose(found, colors(array, "rgb"), atol=2e-5)
