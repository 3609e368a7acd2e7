"""Randomised worlds: a recipe is a world file with random values, objects and camera poses.

world = raycam.sample("table.recipe.toml", 17)

World 17 depends only on the recipe, its seed and the number 17.
"""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..arguments import Floats, product, real, whole
from ..camera import Background, Camera
from ..errors import FormatError, SettingsError, WorldError
from ..io.html_form import html_table
from ..io.text_files import decode_text
from ..progress import bar
from ..world import World
from ..world.description import plain
from ..world.load import load
from .backgrounds import BackgroundFolder
from .calibrated import calibrated
from .convex_prism import ConvexPrism
from .draws import ONE_OF, RandomStream, RejectedSample, check_known_keys
from .drop import Drop, settle_drops
from .placement import PlacementSampler
from .surroundings import Surroundings
from .views import place_camera

__all__ = ["Recipe", "sample"]

PLACE_KEYS = ("on", "gap", "drop", "physics")
"""Object keys, in addition to `count`, that only recipes support."""
MAX_FILE_BYTES = 16 << 20
MAX_OBJECTS = 100_000
GEOMETRY = (
    *(
        "box",
        "plane",
        "sphere",
        "cylinder",
        "cone",
        "torus",
        "mesh",
        "vertices",
        "triangles",
        "refine",
        "upright",
    ),
    *("roll", "pitch", "yaw", "scale", "matrix"),
)
RELIEF = ("displace", "textures", "height_scale", "uvs", "normals", "wrap", "type")
"""Keys that, with `displace`, also change the shape."""
POSE = ("location", "roll", "pitch", "yaw", "scale", "matrix")
LOOK = ("color", "roughness", "metallic", "emission", "category")
"""Keys that change neither an object's shape nor its place."""
MIN_GAP = 0.001
FIRST_TRIES_BATCH = 64
"""Number of objects whose first random poses are checked together."""
MAX_ATTEMPTS = 10
"""Number of attempts to sample a world before an error is raised."""


class Recipe:
    """A recipe for randomised worlds.

    `recipe` is the path of a .toml file, or a dict with the same keys, whose files are in `folder`. A recipe is a
    world file with these additions:

    * A draw may replace any value of an object, a light, a camera and of [render]:
      `{ uniform = [low, high] }` (numbers, or lists of them), `{ log_uniform = [low, high] }`,
      `{ integer = [low, high] }` (both included) or `{ choice = [...] }`, whose items may contain draws.
    * `one_of = [{...}, {...}]` in a table merges one of the tables, chosen at random, into it.
    * `count` repeats an object, a light or a camera, each with its own draws; names get numbers.
    * `on` places an object on another object, given by name. The position and the rotation about the up axis are
      random; the lowest point is on a level surface, at least `gap` (0.001 m) from all other objects. `on = ""` means
      any object. Objects with `on` are placed only on objects without `on`.
    * `drop = { into = "bin" }` or `{ on = "table" }` throws an object from above another object, with a random pose;
      all of them come to rest as with `raycam.settle`, after the objects with `on` are placed. `physics = {...}` of
      any object has the properties that `raycam.settle` accepts.
    * `calibration = "calib.yaml"` in a [[camera]] provides size, K and lens from that file (from its camera with the
      same `name`, if it contains several), and the pose, if neither `see` nor a pose is given. `lens` specifies the
      lens model if the file does not.
    * `see = {...}` in a [[camera]] samples a pose that shows an object, with the keys of
      `raycam.randomize.views.place_camera`.
    * `background = { folder = "photos" }`, or the folder's name, gives each camera of each world a random background
      from the folder, cropped to the frame (`fit = "cover"`); with `fit = "exact"`, the images must have the cameras'
      size.
    * `world` is another world file, glTF or mesh in the same folder, to which the recipe's contents are added.
    * `seed` (0) selects the random numbers.

    Raises `FormatError` if the file is not TOML, `WorldError` for unknown keys, and `OSError` if the file cannot be
    read.
    """

    def __init__(
        self,
        recipe: str | os.PathLike[str] | Mapping[str, Any],
        *,
        folder: str | os.PathLike[str] = ".",
        seed: int | None = None,
    ) -> None:
        if isinstance(recipe, Mapping):
            self.description = dict(recipe)
            self.folder = Path(folder).absolute()
            self._source = ""
        else:
            if not isinstance(recipe, str | os.PathLike):
                raise SettingsError(
                    f"recipe must be a path or a mapping, not {type(recipe).__name__}", code="wrong_type"
                )
            self._source = f"{os.fspath(recipe)}: "
            self.description, self.folder = _read(Path(recipe))
        given = self.description.pop("seed", 0)
        self.seed = whole("seed", given if seed is None else seed, 0, (1 << 64) - 1)
        """The seed of all draws."""
        check_known_keys(
            "a recipe",
            self.description,
            ("up", "world", "object", "light", "camera", "render", "video", "background"),
        )
        for kind in ("object", "light", "camera"):
            one = self.description.get(kind, [])
            rows = [one] if isinstance(one, Mapping) else one
            if not isinstance(rows, Sequence) or not all(isinstance(row, Mapping) for row in rows):
                raise WorldError(f"{kind} must be a list of tables, not {one!r}", code="wrong_type")
            self.description[kind] = [dict(row) for row in rows]

    def _repr_html_(self) -> str:
        """The HTML table shown by notebooks: a row for each object, light and camera of the recipe."""
        rows = [
            (kind, row.get("name", row.get("type", "")), row.get("count", 1), ", ".join(row))
            for kind in ("object", "light", "camera")
            for row in self.description[kind]
        ]
        return html_table(repr(self), ("", "name", "count", "keys"), rows)

    def __repr__(self) -> str:
        """Source, seed and counts of tables as text."""
        counts = [f"{len(self.description[kind])} [[{kind}]]" for kind in ("object", "light", "camera")]
        return (
            f"Recipe {self._source.removesuffix(': ') or 'of a dict'}, seed {self.seed}: {', '.join(counts)}"
        )

    @cached_property
    def _shared(self) -> _core.SharedFiles:
        """The mesh files and images that the worlds share, with their search trees.

        The shared files have at most 1 GiB.
        """
        return _core.SharedFiles()

    def __getstate__(self) -> dict[str, Any]:
        """Returns the state for pickling, without the caches, which are filled again when needed."""
        caches = ("_shared", "_shapes", "_last_surroundings")
        return {key: value for key, value in self.__dict__.items() if key not in caches}

    @cached_property
    def _base(self) -> World | None:
        """The world to which everything is added, loaded once; None without `world`."""
        name = self.description.get("world")
        if name is None:
            return None
        if not isinstance(name, str):
            raise WorldError(f"world must be the name of a file, not {name!r}", code="wrong_type")
        path = self._inside(name)
        if path is None:
            raise WorldError(
                f"world = {name!r} is not in the recipe's folder; only files in it are opened",
                code="outside_root",
            )
        return load(path)

    def _inside(self, name: str) -> Path | None:
        """The path of a file in the recipe's folder; None for a file outside, which is not opened."""
        path = (self.folder / name).resolve()
        return path if path.is_relative_to(self.folder.resolve()) else None

    @cached_property
    def backgrounds(self) -> BackgroundFolder | None:
        """The folder of background images; None without `background`."""
        given = self.description.get("background")
        return None if given is None else BackgroundFolder(given, self.folder)

    def background(self, number: int, camera: str) -> Background | None:
        """Returns the background of `camera` (a name) in world `number`; None without `background`."""
        folder = self.backgrounds
        return None if folder is None else folder.background(self._behind(number, camera))

    def background_name(self, number: int, camera: str) -> str | None:
        """Returns the image name of `background(number, camera)`; None without the key `background`."""
        folder = self.backgrounds
        return None if folder is None else folder.name_of(self._behind(number, camera))

    def _behind(self, number: int, camera: str) -> RandomStream:
        """Returns the random stream of a camera's background image.

        The stream does not change if the world is drawn again.
        """
        return RandomStream(self.seed, "world", number, "background", camera)

    @cached_property
    def _last_surroundings(self) -> dict[str, Surroundings]:
        """The surroundings in the last world in which objects were placed, by cache key."""
        return {}

    @cached_property
    def _shapes(self) -> dict[str, tuple[ConvexPrism, Floats]]:
        """Cache of bounds at the origin and world_from_mesh of placed objects, by their description."""
        return {}

    @cached_property
    def categories(self) -> dict[int, str]:
        """The categories that may occur in the worlds, by id.

        A whole number is its own id; names get unused ids.
        """
        found = dict(self._base.categories) if self._base is not None else {}
        names = [str(value) for value in _values(self.description["object"], "category")]
        for name in names:
            if name.isdigit() and name not in found.values():
                found[int(name)] = name
        for name in names:
            if name not in found.values():
                found[next(number for number in count(1) if number not in found)] = name
        return found

    @property
    def files(self) -> dict[str, str]:
        """The SHA-256 of each file that the recipe uses.

        The files of its meshes and worlds are included.
        """
        found: dict[str, str] = {}
        for key in ("mesh", "texture", "textures", "image", "profile", "world", "calibration"):
            for name in _values(self.description, key):
                path = self._inside(str(name))
                if not isinstance(name, str) or name in found or path is None or not path.is_file():
                    continue
                # The hash of a mesh also covers the mesh's materials, textures and buffers.
                data = load(path).to_bytes() if key in ("mesh", "world") else path.read_bytes()
                found[name] = hashlib.sha256(data).hexdigest()
        if self.backgrounds is not None:
            found[f"{self.backgrounds.name}/"] = self.backgrounds.stamp
        return found

    def check_camera_counts(self) -> None:
        """Raises `WorldError` if the number of cameras may differ between worlds."""
        for number, table in enumerate(self.description["camera"]):
            if isinstance(table.get("count", 1), Mapping) or ONE_OF in table:
                raise WorldError(
                    f"camera[{number}]: all worlds of a data set must have the same cameras; count must be a number, "
                    "and "
                    f'{ONE_OF} is only supported within "see"',
                    code="conflicting_values",
                )

    def world(self, number: int) -> World:
        """Returns world `number`, counted from 0; the world does not depend on other worlds.

        If an object has no space or a camera no view, the whole world is drawn again, at most `MAX_ATTEMPTS` times.

        Raises the errors of `World.from_dict`, and `WorldError` if no attempt succeeds.
        """
        draw = RandomStream(self.seed, "world", whole("number", number, 0, 1 << 62))
        with bar(f"drawing world {number}") as progress:
            for chance in range(MAX_ATTEMPTS):
                progress(chance, MAX_ATTEMPTS)
                try:
                    return self._with_backgrounds(
                        self._drawn(draw.substream("again", chance) if chance else draw), number
                    )
                except RejectedSample as fault:
                    last = fault
                except WorldError as fault:
                    raise WorldError(f"{self._source}{fault}", code=fault.code) from None
        raise WorldError(
            f"{self._source}{last} (world {number}: all {MAX_ATTEMPTS} draws were rejected; this is the last draw's "
            "reason)",
            code=last.code,
        )

    def _with_backgrounds(self, world: World, number: int) -> World:
        """The world with background images for cameras without one, except for cameras of rigs."""
        if self.backgrounds is not None:
            mounted = {f"{name}/{camera}" for name, rig in world.rigs.items() for camera in rig}
            for name, camera in world.cameras.items():
                if name not in mounted and camera.background is None:
                    world.set_camera(name, camera.with_background(self.background(number, name)))
        return world

    def _drawn(self, draw: RandomStream) -> World:
        """Builds the world of a random stream; may raise `RejectedSample`."""
        still: list[dict[str, Any]] = []
        placed: list[tuple[dict[str, Any], dict[str, Any], RandomStream]] = []
        dropped: list[tuple[dict[str, Any], Drop]] = []
        fixed: dict[str, dict[str, Any]] = {}
        for item, place in self._rows("object", draw):
            how = {key: item.pop(key) for key in PLACE_KEYS if key in item}
            what = f"object {item.get('name', '')!r}"
            if "drop" in how:
                if how.keys() & {"on", "gap"} or item.keys() & {"location", "instance_of"}:
                    raise WorldError(
                        f'{what}: the keys "on", "gap", "location" and "instance_of" cannot be used with "drop"',
                        code="conflicting_values",
                    )
                dropped.append((item, Drop(how["drop"], how.get("physics", {}), what)))
                continue
            if "physics" in how:
                fixed[_named(item, what)] = how.pop("physics")
            if "on" in how:
                placed.append((item, how, place))
            elif how:
                raise WorldError(
                    f'{what}: the key "gap" requires the key "on"',
                    code="missing_value",
                )
            else:
                still.append(item)
        world = self._begun(draw, still)
        first: dict[str, str] = {}
        if placed:
            self._place_objects(world, self._surroundings(world, still), placed, first)
        names = [self._add_shared(world, item, first) for item, _ in dropped]
        settle_drops(
            world, [(name, drop) for name, (_, drop) in zip(names, dropped, strict=True)], fixed, draw
        )
        for light, _ in self._rows("light", draw):
            _core.world_add_light(world._core, plain(light), self.folder, self._shared)
        for camera, place in self._rows("camera", draw):
            self._place_cameras(world, camera, place)
        return world

    def _rows(self, kind: str, draw: RandomStream) -> list[tuple[dict[str, Any], RandomStream]]:
        """Returns the tables of one kind with drawn values, `count` times each, and their streams."""
        found: list[tuple[dict[str, Any], RandomStream]] = []
        for i, table in enumerate(self.description[kind]):
            row = dict(table)
            place, where = draw.substream(kind, i), f"{kind}[{i}]"
            drawn = place.substream("count").value(row.pop("count", None), f"{where}.count")
            copies = 1 if drawn is None else whole(f"{where}.count", drawn, 0, MAX_OBJECTS)
            for copy in range(copies):
                here = place.substream(copy)
                one = here.value(row, where)
                if drawn is not None and kind != "light" and isinstance(one.get("name"), str):
                    one["name"] = f"{one['name']}-{copy + 1}"
                found.append((one, here))
        return found

    def _begun(self, draw: RandomStream, objects: list[dict[str, Any]]) -> World:
        """The world with all objects that are not placed at random."""
        table = self.description
        render = draw.substream("render").value(table.get("render", {}), "render")
        if self._base is None:
            more = {"video": table["video"]} if "video" in table else {}
            return World._described(
                {"up": table.get("up", "z"), "object": objects, "render": render, **more},
                self.folder,
                None,
                shared=self._shared,
            )
        for key in ("up", "render"):
            if key in table:
                raise WorldError(
                    f"{key}: a recipe cannot contain this key; set it in {table['world']}",
                    code="conflicting_values",
                )
        # World.at returns a separate world that shares the acceleration structures.
        world = self._base.at(0.0)
        for item in objects:
            self._add(world, item)
        if "video" in table:
            world.set_video(table["video"])
        return world

    def _add(self, world: World, item: Mapping[str, Any]) -> int:
        """Adds an object; its files must be in the recipe's folder, because a recipe is untrusted."""
        return _core.world_add_object(world._core, plain(item), self.folder, self._shared)

    def _surroundings(self, world: World, still: list[dict[str, Any]]) -> Surroundings:
        """Returns the fixed objects among which objects are placed.

        Successive worlds whose fixed objects have equal shapes and poses share the result. `still` are the
        descriptions of the fixed objects.
        """
        rows = [{key: value for key, value in row.items() if key not in LOOK} for row in still]
        key = _cache_key([world.up, rows])
        known = self._last_surroundings.get(key)
        if known is None:
            known = Surroundings(world)
            self._last_surroundings = {key: known}
        return known

    def _place_objects(
        self,
        world: World,
        surroundings: Surroundings,
        placed: list[tuple[dict[str, Any], dict[str, Any], RandomStream]],
        first: dict[str, str],
    ) -> None:
        placer = PlacementSampler(surroundings)
        ready: list[tuple[ConvexPrism, Floats, float, str]] = []
        by_surface: dict[str, list[int]] = {}
        for number, (item, how, _) in enumerate(placed):
            what = f"object {item.get('name', '')!r}".replace(" ''", "")
            gap = _checked_gap(item, how, what)
            try:
                shape, matrix = self._shape(world, item)
            except WorldError as fault:
                raise WorldError(f"{what}: {fault}", code=fault.code) from None
            ready.append((shape, matrix, gap, what))
            by_surface.setdefault(how["on"], []).append(number)
        for surface, numbers in by_surface.items():
            shapes = [ready[number][0] for number in numbers]
            placer.check_total_area(shapes, surface or None, ready[numbers[0]][3])
        requests = [
            (shape, how["on"] or None, place.substream("on"))
            for (_, how, place), (shape, *_) in zip(placed, ready, strict=True)
        ]
        for number, ((item, _, _), (_, matrix, gap, what)) in enumerate(zip(placed, ready, strict=True)):
            position = number % FIRST_TRIES_BATCH
            if position == 0:
                tries = placer.sample_first_tries(requests[number : number + FIRST_TRIES_BATCH])
            pose = placer.sample_pose(*requests[number], gap, what, tries[position])
            row = {key: value for key, value in item.items() if key not in POSE}
            if "mesh" in row and "matrix" not in item:
                row.setdefault("upright", True)  # the pose is relative to the mesh as `_shape` measured it
            self._add_shared(world, {**row, "matrix": product(pose, matrix).tolist()}, first)

    def _add_shared(self, world: World, item: Mapping[str, Any], first: dict[str, str]) -> str:
        """Adds an object, and returns its name.

        Objects of one shape share a mesh, unless they would inherit the first object's appearance. `first`
        contains the names of objects by shape.
        """
        row = {key: value for key, value in item.items() if key not in POSE}
        style = row.keys() - {*GEOMETRY, "name", "category"}
        key = _cache_key([_select_keys(row, GEOMETRY), sorted(style)])
        if (
            key in first
            and "category" in row
            and not row.keys() & {"face_colors", "vertex_colors", "uvs", "normals", "displace"}
        ):
            row = {k: v for k, v in row.items() if k not in GEOMETRY} | {"instance_of": first[key]}
        number = self._add(world, {**row, **_select_keys(item, POSE)})
        name = world._core.objects[number][0]  # `world.objects` would create a record for every object
        first.setdefault(key, name)
        return name

    def _shape(self, world: World, item: Mapping[str, Any]) -> tuple[ConvexPrism, Floats]:
        """The bound of an object at the origin, and its world_from_mesh."""
        alone = _select_keys(item, (*GEOMETRY, *RELIEF) if item.get("displace") else GEOMETRY)
        key = _cache_key([world.up, alone])
        if key not in self._shapes:
            thing = World(world.up)
            self._add(thing, alone)
            if len(self._shapes) >= 256:
                self._shapes.pop(next(iter(self._shapes)))
            self._shapes[key] = (ConvexPrism.around(thing.triangles(), world.up), thing.objects[0].matrix)
        return self._shapes[key]

    def _place_cameras(self, world: World, table: Mapping[str, Any], place: RandomStream) -> None:
        row = dict(table)
        wanted = row.pop("see", None)
        name = row.get("name", "camera")
        if wanted is not None and not isinstance(wanted, Mapping):
            raise WorldError(f'camera {name!r}: "see" must be a table, not {wanted!r}', code="wrong_type")
        if "calibration" in row:
            path = self._inside(str(row["calibration"]))
            if path is None:
                raise WorldError(
                    f"camera {name!r}: calibration = {row['calibration']!r} is not in the recipe's folder",
                    code="outside_root",
                )
            row = calibrated(row, path, world.up, f"camera {name!r}")
        if wanted is not None:
            row = {key: value for key, value in row.items() if key != "t"}
            row |= {"R": np.eye(3).tolist(), "C": [0.0, 0.0, 0.0]}
        lens: Camera = next(
            iter(World.from_dict({"up": world.up, "camera": [row]}, folder=self.folder).cameras.values())
        )
        camera = (
            lens
            if wanted is None
            else place_camera(world, lens, wanted, place.substream("see"), f"camera {name!r}")
        )
        world.add_camera(camera, name)


def sample(
    recipe: str | os.PathLike[str] | Mapping[str, Any] | Recipe,
    number: int = 0,
    *,
    seed: int | None = None,
    folder: str | os.PathLike[str] = ".",
) -> World:
    """Returns world `number` of a recipe; for many worlds, `Recipe` is faster.

    `recipe` and `folder` are as in `Recipe`; `seed` replaces the recipe's seed. The same recipe, seed and number
    produce the same world on every machine, except for the last bits of sine and cosine. Raises the errors of `Recipe`
    and `Recipe.world`.
    """
    if isinstance(recipe, Recipe):
        return recipe.world(number)
    return Recipe(recipe, folder=folder, seed=seed).world(number)


def _checked_gap(item: Mapping[str, Any], how: Mapping[str, Any], what: str) -> float:
    """Returns the gap of an object that is placed at random.

    Raises `WorldError` for keys that do not fit.
    """
    if "location" in item or "instance_of" in item:
        raise WorldError(
            f'{what}: the keys "location" and "instance_of" cannot be used with "on", which sets the position',
            code="conflicting_values",
        )
    gap = real(f"{what}: gap", how.get("gap", MIN_GAP), 0.0, what="a distance in metres", error=WorldError)
    if not isinstance(how["on"], str):
        raise WorldError(
            f"{what}: the key 'on' must be the name of an object, not {how['on']!r}", code="wrong_type"
        )
    return gap


def _read(path: Path) -> tuple[dict[str, Any], Path]:
    with path.open("rb") as file:
        data = file.read(MAX_FILE_BYTES + 1)
    if len(data) > MAX_FILE_BYTES:
        raise FormatError(
            f"{path}: the recipe is too large; the limit is {MAX_FILE_BYTES >> 20} MiB",
            code="budget_exceeded",
        )
    _core.check_stand_in(path, data)
    try:
        return tomllib.loads(decode_text(data)), path.absolute().parent
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as fault:
        raise FormatError(f"{path}: not a TOML file: {fault}") from None


def _cache_key(description: Any) -> str:
    """Returns a text that is equal for equal descriptions.

    The text contains hashes of arrays.
    """

    def stamp(value: Any) -> Any:
        if not hasattr(value, "__array__"):
            return repr(value)
        array = np.ascontiguousarray(value)
        return [str(array.dtype), array.shape, hashlib.sha256(array.tobytes()).hexdigest()]

    return json.dumps(description, sort_keys=True, default=stamp)


def _named(item: Mapping[str, Any], what: str) -> str:
    """Returns the name of an object with `physics`; raises `WorldError` if it has no name."""
    if not isinstance(item.get("name"), str):
        raise WorldError(f'{what}: an object with physics requires the key "name"', code="missing_value")
    return str(item["name"])


def _select_keys(table: Mapping[str, Any], keys: Sequence[str]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key in keys}


def _values(description: Any, key: str) -> Iterator[Any]:
    """Yields all values that a key may have anywhere in a description.

    The values include the options of draws.
    """
    if isinstance(description, Mapping):
        for name, value in description.items():
            if name == key:
                yield from _leaves(value)
            elif isinstance(value, Mapping | list | tuple):
                yield from _values(value, key)
    elif isinstance(description, list | tuple):
        for value in description:
            yield from _values(value, key)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, Mapping):
        for inner in value.values():
            yield from _leaves(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _leaves(inner)
    else:
        yield value
