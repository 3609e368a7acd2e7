use raycam_scene::counted;

#[test]
fn counted_nouns_are_singular_for_one_and_plural_otherwise() {
    assert_eq!(counted(0, "camera"), "0 cameras");
    assert_eq!(counted(1, "camera"), "1 camera");
    assert_eq!(counted(2, "camera"), "2 cameras");
    assert_eq!(counted(1, "vertex"), "1 vertex");
    assert_eq!(counted(3, "vertex"), "3 vertices");
    assert_eq!(counted(2, "matrix"), "2 matrices");
}
