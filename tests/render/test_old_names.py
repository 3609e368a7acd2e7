"""Old names of render options: understood with a notice, refused beside their new name."""

import pytest
import raycam
from raycam.render.old_names import OLD_NAMES, current_names


@pytest.fixture(scope="module")
def world():
    world = raycam.World()
    world.add_object(box={"size": 1})
    world.add_light({"type": "sky", "radiance": [1, 1, 1]})
    return world


@pytest.mark.parametrize(("old", "value"), [("noise", 0.5), ("transparent", True)])
def test_an_old_name_gives_the_same_picture_and_a_notice(world, old, value):
    camera = world.default_camera((16, 12))
    expected = raycam.render(world, camera, **{OLD_NAMES[old]: value})
    with pytest.warns(raycam.Notice, match=f"{old} is called {OLD_NAMES[old]} now"):
        frame = raycam.render(world, camera, **{old: value})
    assert frame["color"].tobytes() == expected["color"].tobytes()


def test_time_is_a_time_limit():
    with pytest.warns(raycam.Notice, match="time_limit"):
        assert current_names({"time": 3.0, "samples": 4}) == {"time_limit": 3.0, "samples": 4}


def test_both_names_of_an_option_are_an_error(world):
    with pytest.raises(raycam.SettingsError, match="two names of one option: give noise_threshold"):
        raycam.render(world, noise=0.1, noise_threshold=0.1)


def test_an_unknown_option_names_the_nearest(world):
    with pytest.raises(raycam.SettingsError, match="did you mean 'samples'"):
        raycam.render(world, sample=4)
