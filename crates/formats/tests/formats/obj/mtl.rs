use std::fs;

use raycam_formats::{Budget, load, read_model};
use raycam_scene::color::linear_from_srgb;
use raycam_scene::{Alpha, MaterialModel, MeshFile, Texels, Wrap};

use crate::support::{folder, message, rgb};

/// A triangle with a material of this file, in a new folder with a texture.
fn model(mtl: &str) -> Result<MeshFile, String> {
    within(&Budget::default(), mtl)
}

fn within(budget: &Budget, mtl: &str) -> Result<MeshFile, String> {
    let folder = folder();
    let path = folder.join("a.obj");
    fs::write(&path, "mtllib my\\ materials.mtl other.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m 1\nf 1 2 3\n").unwrap();
    fs::write(folder.join("my materials.mtl"), mtl).unwrap();
    fs::write(folder.join("other.mtl"), "# nothing\n").unwrap();
    fs::create_dir(folder.join("textures")).unwrap();
    for name in ["wood.png", "textures/my wood.png", "-x.png"] {
        let png = raycam_formats::encode::png::encode(
            [1, 2],
            3,
            raycam_formats::encode::png::Samples::U8(&[255, 0, 0, 0, 255, 0]),
        );
        fs::write(folder.join(name), png.unwrap()).unwrap();
    }
    let clear = raycam_formats::encode::png::encode(
        [2, 1],
        4,
        raycam_formats::encode::png::Samples::U8(&[7, 7, 7, 255, 8, 8, 8, 51]),
    );
    fs::write(folder.join("clear.png"), clear.unwrap()).unwrap();
    let grey = raycam_formats::encode::png::encode([1, 1], 1, raycam_formats::encode::png::Samples::U8(&[9]));
    fs::write(folder.join("grey.png"), grey.unwrap()).unwrap();
    read_model(&path, budget).map_err(|error| message(error, &path))
}

fn notices(mtl: &str) -> String {
    model(mtl).unwrap().notices.join("\n")
}

#[test]
fn colours_and_shininess_are_read() {
    let model = model("newmtl m 1\nKd 0.5 0.25 0.125 # wood\nKs 0.1\nNs 40\nillum 2\nd 1\nTr 0\nKe 0 0 0\n").unwrap();
    assert!(model.notices.is_empty(), "{:?}", model.notices);
    let material = &model.materials[0];
    assert_eq!((&material.name[..], material.color), ("m 1", [0.5, 0.25, 0.125]));
    let MaterialModel::Phong { diffuse, specular, shininess } = material.model else { panic!() };
    assert_eq!((diffuse, specular, shininess), (1.0, [0.1; 3], 40.0));
}

#[test]
fn what_programs_write_and_do_not_mean_is_taken_as_meant() {
    let model = model("newmtl m 1\nNi 0\nTr 1\nmap_Kd -colorspace sRGB wood.png\n").unwrap();
    assert_eq!(model.materials[0].opacity, 1.0);
    assert!(model.materials[0].texture.is_some());
    let [notice] = &model.notices[..] else {
        panic!("{:?}", model.notices);
    };
    assert!(notice.contains(":3: Tr is 1"), "{notice}");
    let found = notices("newmtl m 1\nmap_Kd -colorspace linear wood.png\n");
    assert!(found.contains("\"-colorspace linear\" is not applied"), "{found}");
}

#[test]
fn physically_based_keys_make_a_principled_material() {
    let model = model(
        "newmtl m 1\nKd 0.5 0.25 0.125\nPr 0.3\nPm 0.75\nPs 0.1\nPc 0.5\nPcr 0.2\naniso 0.4\nanisor 0.25\n\
         Ke 2 1 0\nNi 1.4\nmap_Kd -s 2 3 -o 0.5 0.25 wood.png\nnorm -bm 0.5 -x.png\nmap_Pr wood.png\nd 0.75\n",
    )
    .unwrap();
    assert!(model.notices.is_empty(), "{:?}", model.notices);
    let material = &model.materials[0];
    let MaterialModel::Principled(principled) = &material.model else {
        panic!("{:?}", material.model);
    };
    let values = [
        principled.roughness.value,
        principled.metallic.value,
        principled.sheen_color.value[1],
        principled.clearcoat.value,
        principled.clearcoat_roughness.value,
        principled.anisotropy.value,
        principled.anisotropy_rotation,
        principled.ior,
    ];
    let quarter = std::f32::consts::FRAC_PI_2;
    assert_eq!(values, [0.3, 0.75, 0.1, 0.5, 0.2, 0.4, quarter, 1.4]);
    assert_eq!(material.color, [0.5, 0.25, 0.125]);
    assert_eq!(material.emission.value, [2.0, 1.0, 0.0]);
    assert_eq!((material.opacity, material.alpha), (0.75, Alpha::Blend));
    material.validate().unwrap();
    let image = |texture: usize| &model.textures[texture].image;
    let color = material.texture.unwrap();
    // In the file (u, v) goes to (2 u + 0.5, 3 v + 0.25), with v from the bottom: (0.25, 0.75) to (1, 1.0).
    assert_eq!(color.coordinates([0.25, 0.75]), [1.0, 0.0]);
    assert!(matches!(image(color.texture).texels, Texels::Srgb8(_)));
    let normal = material.normal_map.unwrap();
    assert_eq!(normal.scale, 0.5);
    assert!(matches!(image(normal.texture.texture).texels, Texels::Linear8(_)));
    let roughness = principled.roughness.texture.unwrap();
    assert!(matches!(image(roughness.texture).texels, Texels::Linear8(_)));
}

#[test]
fn refracting_materials_are_glass() {
    let model = model("newmtl m 1\nKd 0 0 0\nTf 0.9 1 0.9\nNi 1.6\nNs 998\nillum 7\nd 0.1\n").unwrap();
    let material = &model.materials[0];
    let MaterialModel::Principled(principled) = &material.model else {
        panic!("{:?}", material.model);
    };
    assert_eq!((principled.transmission.value, principled.ior), (1.0, 1.6));
    // alpha^2 = 2 / 1000, and roughness is alpha's root.
    assert!((principled.roughness.value - 0.002_f32.powf(0.25)).abs() < 1e-6);
    assert_eq!((material.color, material.alpha), ([0.9, 1.0, 0.9], Alpha::Opaque));
}

#[test]
fn no_more_light_comes_back_than_falls_in() {
    let model = model("newmtl m 1\nKd 0.75 0.5 0\nKs 0.5 0.5 0.5\n").unwrap();
    let MaterialModel::Phong { specular, .. } = model.materials[0].model else { panic!() };
    assert_eq!(specular, [0.25, 0.5, 0.5]);
    assert!(model.notices[0].contains("my materials.mtl:1: material \"m 1\" reflects more than all light"));
    // Illumination model 1 has no highlights.
    assert_eq!(notices("newmtl m 1\nKd 0.75 0.5 0\nKs 0.5 0.5 0.5\nillum 1\n"), "");
}

#[test]
fn textures_are_found_by_names_of_every_kind() {
    for map in [
        "wood.png",
        "textures/my wood.png",
        "textures\\my wood.png",
        "textures/my\\ wood.png",
        "./textures/../wood.png",
        "-x.png",
        "-blendu on -s 1 1 1 -o 0 -mm 0 1 wood.png",
    ] {
        let model = model(&format!("newmtl m 1\nmap_Kd {map}\n")).unwrap();
        assert!(model.notices.is_empty(), "{map}: {:?}", model.notices);
        assert_eq!(model.materials[0].texture.map(|t| t.texture), Some(0), "{map}");
        assert_eq!(rgb(&model.textures[0]), [[255, 0, 0], [0, 255, 0]]);
        assert_eq!(model.textures[0].sampler.wrap, [Wrap::Repeat; 2]);
    }
    let model = model("newmtl m 1\nmap_Kd -clamp on wood.png\n").unwrap();
    assert_eq!(model.textures[0].sampler.wrap, [Wrap::Clamp; 2]);
}

/// The first texture, its material being cut out by it.
fn cut_out(maps: &str) -> Texels {
    let model = model(&format!("newmtl m 1\nKd 1 0.5 1\n{maps}\n")).unwrap();
    let material = &model.materials[0];
    assert_eq!((material.color, material.opacity, material.alpha), ([1.0, 0.5, 1.0], 1.0, Alpha::Blend));
    assert_eq!(model.textures.len(), 1, "no other image is kept");
    assert_eq!(material.texture.map(|slot| slot.texture), Some(0));
    material.validate().unwrap();
    model.textures[0].image.texels.clone()
}

#[test]
fn opacity_has_an_image_of_its_own() {
    // How light a texel is, whichever comes first; as 9 of 255 is at both texels of the colours.
    let grey = Texels::Srgb8(vec![[255, 0, 0, 9], [0, 255, 0, 9]]);
    for maps in [
        "map_Kd wood.png\nmap_d grey.png",
        "map_d clear.png\nmap_d -imfchan l grey.png\nmap_Kd clear.png\nmap_Kd wood.png",
        "map_Kd wood.png\nmap_d ./textures\\..\\grey.png",
    ] {
        assert_eq!(cut_out(maps), grey, "{maps}");
    }
    // An image that is both has its own alpha.
    let both = Texels::Srgb8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]);
    assert_eq!(cut_out("map_Kd wood.png\nmap_d wood.png"), both);
    // Its alpha, where it has any; without colours they are white.
    let white = [[255, 255, 255, 255], [255, 255, 255, 51]];
    assert_eq!(cut_out("map_d clear.png"), Texels::Srgb8(white.into()));
    // How light colours are: Rec. 709's shares of red and green.
    let shares = [[255, 255, 255, 54], [255, 255, 255, 182]];
    assert_eq!(cut_out("map_d wood.png"), Texels::Srgb8(shares.into()));
    // A colour of one texel under an opacity of two.
    let nine = (65535.0 * linear_from_srgb(9.0 / 255.0)).round() as u16;
    let spread = [[nine, nine, nine, 65535], [nine, nine, nine, 13107]];
    let found = cut_out("map_Kd grey.png\nmap_d clear.png");
    assert_eq!(found, Texels::Linear16(spread.into()));
    // Laid on as both say, and not in the place of the same colours without it.
    let clamped = model("newmtl m 1\nmap_Kd -clamp on wood.png\nmap_d -clamp on grey.png\n").unwrap();
    assert_eq!(clamped.textures[0].sampler.wrap, [Wrap::Clamp; 2]);
    let glowing = model("newmtl m 1\nmap_Kd wood.png\nmap_d grey.png\nmap_Ke wood.png\n").unwrap();
    let glow = glowing.materials[0].emission.texture.unwrap();
    let glow = &glowing.textures[glow.texture].image.texels;
    assert_eq!(glow, &Texels::Srgb8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]));
    // One that is not there leaves the colours as they are.
    let model = model("newmtl m 1\nmap_Kd wood.png\nmap_d no.png\n").unwrap();
    assert_eq!(rgb(&model.textures[0]), [[255, 0, 0], [0, 255, 0]]);
    assert!(model.notices[0].contains("no.png: No such file"));
}

#[test]
fn images_that_are_made_are_paid_for() {
    for (maps, needed) in [("map_Kd wood.png\nmap_d clear.png", 6), ("bump grey.png", 2)] {
        for (pixels, fits) in [(needed, true), (needed - 1, false)] {
            let budget = Budget { pixels, ..Budget::default() };
            let read = within(&budget, &format!("newmtl m 1\n{maps}\n"));
            assert_eq!(read.is_ok(), fits, "{maps}: {pixels}");
        }
    }
}

#[test]
fn what_is_not_applied_is_said() {
    let text = notices(
        "newmtl m 1\nTf 1 1 1\nNi 1.45\nmap_refl sky.png\nKd spectral file.rfl\nmap_Kd -mm 0.5 1 wood.png\n\
         d -halo 0.5\nmap_d -s 2 grey.png\n",
    );
    assert!(text.contains("map_Kd option \"-mm 0.5 1\" is not applied"), "{text}");
    let expected = "not used: map_refl (line 4), Kd spectral file.rfl (line 5), d -halo 0.5 (line 7)";
    assert!(text.contains(expected), "{text}");
    assert!(text.contains("mtl:8: map_d is not used: it is laid on otherwise than map_Kd"), "{text}");
    assert!(notices("newmtl m 1\nmap_Kd wood.png\nmap_d -clamp on grey.png\n").contains(":3: map_d is not used"));
    assert!(notices("newmtl m 1\nNs -1.96\n").contains(":2: Ns is -1.96, taken as 0"));
    assert!(notices("newmtl m 1\nnorm grey.png\n").contains("\"grey.png\" is a map of heights: made"));
    assert!(notices("newmtl m 1\nmap_Kd\n").contains(":2: map_Kd without a file name"));
    assert!(notices("newmtl other\nKd 1 0 0\n").contains("materials without a definition are plain: m 1"));
}

#[test]
fn missing_and_forbidden_files_are_left_out_with_a_notice() {
    let outside = folder().join("secret.png");
    fs::write(&outside, "x").unwrap();
    for (map, expected) in [
        ("no.png", "no.png: No such file"),
        ("textures", "textures: Is a directory"),
        ("../secret.png", "file name \"../secret.png\": it leads out of the folder"),
        ("/etc/passwd", "file name \"/etc/passwd\": expected a path relative"),
        ("file:///etc/passwd", "expected a path relative"),
        ("C:\\wood.png", "expected a path relative"),
        ("a.obj", "not an image that is known"),
    ] {
        let model = model(&format!("newmtl m 1\nKd 0.5 0.5 0.5\nmap_Kd {map}\n")).unwrap();
        assert!(model.notices[0].contains(expected), "{map}: {:?}", model.notices);
        assert_eq!((model.textures.len(), model.materials[0].texture.map(|t| t.texture)), (0, None));
    }
    let path = folder().join("a.obj");
    fs::write(&path, "mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n").unwrap();
    let world = load(&path, &Budget::default()).unwrap();
    assert!(world.notices[0].contains("left out") && world.notices[0].contains("no.mtl"), "{:?}", world.notices);
    assert_eq!(world.materials[0].color, [0.8; 3]);
}

#[test]
fn bad_values_are_told_with_line() {
    for (text, expected) in [
        ("Kd 1 2 3", "my materials.mtl:2: \"Kd\" is \"1 2 3\", expected 1 or 3 numbers in 0..=1"),
        ("Kd 1 1", "my materials.mtl:2: \"Kd\" is \"1 1\", expected 1 or 3 numbers in 0..=1"),
        ("Ks nan 0 0", "my materials.mtl:2: \"Ks\" is \"nan 0 0\", expected 1 or 3 numbers in 0..=1"),
        ("Ns many", "my materials.mtl:2: Ns is \"many\", expected a number in 0..=1000000"),
        ("illum 99", "my materials.mtl:2: illum is \"99\", expected 0 to 10"),
        ("map_Kd -s wood.png", "my materials.mtl:2: map_Kd: option \"-s\" without its value"),
    ] {
        let found = model(&format!("newmtl m 1\n{text}\n"));
        if text.starts_with("map_Kd") {
            // The name of the file is taken for the factor, and then there is no file.
            assert!(found.unwrap().notices.iter().any(|n| n.contains("map_Kd without a file name")));
        } else {
            assert_eq!(found.unwrap_err(), expected);
        }
    }
}
