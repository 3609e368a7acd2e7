//! Categories that are names, numbers, or a mixture of both.

use glam::DAffine3;
use raycam_scene::mesh::primitive;
use raycam_scene::{Material, NoAssets, Object, World, schema};

fn world(categories: &[Option<&str>]) -> World {
    let mut world = World::default();
    let mesh = primitive::plane([1.0, 1.0]).unwrap();
    let material = world.add_material(Material::for_mesh(&mesh)).unwrap();
    let mesh = world.add_mesh(mesh);
    for category in categories {
        let id = world.add_object(Object::new("", mesh, vec![material], DAffine3::IDENTITY)).unwrap();
        world.objects[id].category = category.map(Into::into);
    }
    world
}

#[test]
fn category_names_get_the_free_numbers() {
    let categories = world(&[Some("car"), None, Some("2"), Some("tree"), Some("car"), Some("0")]).categories();
    assert_eq!(categories.of_objects, [1, -1, 2, 3, 1, 0]);
    let names: Vec<_> = categories.names.iter().map(|(id, name)| (*id, &name[..])).collect();
    assert_eq!(names, [(0, "0"), (1, "car"), (2, "2"), (3, "tree")]);
    // A name that is a number in a form other than the canonical one is an ordinary name.
    assert_eq!(world(&[Some("07"), Some("-1"), Some("7")]).categories().of_objects, [1, 2, 7]);
    assert_eq!(world(&[]).categories(), Default::default());
}

#[test]
fn categories_are_read_from_numbers_or_names() {
    use schema::Value::{Float, Integer};
    let text = |text: &str| schema::Value::String(text.into());
    let entry = |key: &str, value| schema::Entry {
        key: key.into(),
        key_span: None,
        value: schema::SpannedValue { value, span: None },
    };
    let of = |category| -> Result<Option<String>, String> {
        let shape = schema::Value::Table(vec![entry("size", Float(1.0))]);
        let table = schema::Value::Table(vec![entry("box", shape), entry("category", category)]);
        let node = schema::SpannedValue { value: table, span: None };
        let spec: schema::ObjectSpec = schema::from_value(&node).map_err(|e| e.to_string())?;
        let mut world = World::default();
        let id = spec.build(&mut world, &mut NoAssets).map_err(|e| e.to_string())?;
        Ok(world.objects[id].category.clone())
    };
    assert_eq!(of(text("car")), Ok(Some("car".into())));
    assert_eq!(of(Integer(7)), Ok(Some("7".into())));
    for wrong in [Integer(-1), Integer(1 << 40), Float(1.5), text("")] {
        let error = of(wrong).unwrap_err();
        assert!(error.contains("a name or a whole number"), "{error}");
    }
}

#[test]
fn instances_inherit_the_category_of_their_original() {
    let mut world = World::default();
    let spec = schema::ObjectSpec {
        name: Some("a".into()),
        category: Some(schema::Category("car".into())),
        plane: Some(schema::PlaneShape::default()),
        ..Default::default()
    };
    spec.build(&mut world, &mut NoAssets).unwrap();
    let again = schema::ObjectSpec { instance_of: Some("a".into()), ..Default::default() };
    again.clone().build(&mut world, &mut NoAssets).unwrap();
    let other = schema::ObjectSpec { category: Some(schema::Category("toy".into())), ..again };
    other.build(&mut world, &mut NoAssets).unwrap();
    assert_eq!(world.categories().of_objects, [1, 1, 2]);
}
