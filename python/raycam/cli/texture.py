"""The command `raycam texture`."""

from __future__ import annotations

import argparse

from .options.command import Command
from .options.photographs import add_photograph_cameras, photograph_cameras
from .options.worlds import add_world, load_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    add_photograph_cameras(command)
    command.add_argument("--photos", metavar="DIR", required=True, help="folder with the photographs")
    command.add_argument("-o", "--output", metavar="GLB", required=True, help="textured model to write")
    command.add_argument(
        "--object", metavar="NAME", default=None, help="object to texture (default: the first)"
    )
    command.add_argument(
        "--texture-size",
        metavar="N",
        type=int,
        default=2048,
        help="side of the texture in texels (default: 2048)",
    )
    command.add_argument(
        "--show-unseen",
        action="store_true",
        help="show in magenta the texels that are not visible to any camera (default: nearest visible colour)",
    )
    command.add_argument(
        "--atlas",
        metavar="NAME",
        help="new texture coordinates: xatlas (requires raycam[atlas]) or cells (default: use the mesh's own)",
    )
    command.add_argument(
        "--report",
        metavar="HTML",
        help="HTML page to write: photographs per texel and their disagreement, statistics of each photograph, and "
        "photographs next to the textured model",
    )
    command.add_argument(
        "--method",
        metavar="NAME",
        default="blend",
        help="blend (default): mean of the best photographs; best: one photograph for each face, with levelled seams; "
        "detail: low frequencies of blend, high frequencies of best",
    )
    command.add_argument(
        "--exposure",
        metavar="NAME",
        default="auto",
        help="auto (default): equalise the exposure and white balance of overlapping photographs; "
        "off: use the photographs unchanged",
    )
    command.add_argument(
        "--orientation",
        metavar="NAME",
        default="auto",
        help="use of the photographs' EXIF orientation: auto (default; rotates a photograph only if it does not fit "
        "its camera otherwise), apply (always rotates it) or ignore (never rotates it)",
    )
    command.add_argument(
        "--memory",
        metavar="SIZE",
        default="1 GiB",
        help='memory for the colours that the photographs show at each texel, such as "4 GiB" (default: 1 GiB); if the '
        "memory is too small for all texels, photographs are read more than once",
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..arguments import whole
    from ..photos import texture_from_photos
    from ..photos.texture import SIZE_RANGE

    world, cameras = load_world(options), photograph_cameras(options)
    result = texture_from_photos(
        world,
        cameras,
        options.photos,
        object=0 if options.object is None else options.object,
        size=whole("--texture-size", options.texture_size, *SIZE_RANGE),
        atlas=options.atlas,
        method=options.method,
        exposure=options.exposure,
        orientation=options.orientation,
        show_unseen=options.show_unseen,
        memory=options.memory,
        threads=options.threads,
    )
    result.world.to_gltf(options.output)
    if options.report is not None:
        result.save_report(options.report)
    share = 100 * result.seen.sum() / result.covered.sum()
    print(f"{options.output}: {share:.3g} % of the texels are visible to {len(cameras)} photographs")


COMMAND = Command(
    _add,
    "texture a mesh with posed photographs",
    [
        "raycam texture scan.glb --cameras sparse/0 --photos images -o textured.glb",
        "raycam texture scan.glb --cameras sparse/0 --photos images -o textured.glb --texture-size 4096 --show-unseen",
        "raycam texture scan.ply --cameras sparse/0 --photos images -o out.glb --atlas xatlas --report report.html",
    ],
)
