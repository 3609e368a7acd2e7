use raycam_scene::counted;

#[test]
fn counted_nouns_are_singular_for_one_and_plural_otherwise() {
    for (number, noun, expected) in [
        (0, "camera", "0 cameras"),
        (1, "camera", "1 camera"),
        (2, "camera", "2 cameras"),
        (1, "vertex", "1 vertex"),
        (3, "vertex", "3 vertices"),
        (2, "matrix", "2 matrices"),
        (2, "mesh", "2 meshes"),
        (2, "entry", "2 entries"),
        (2, "key", "2 keys"),
    ] {
        assert_eq!(counted(number, noun), expected);
    }
}
