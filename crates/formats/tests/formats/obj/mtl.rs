use std::fs;

use raycam_formats::{Budget, load, read_model};
use raycam_scene::color::linear_from_srgb;
use raycam_scene::{Alpha, MaterialModel, MeshFile, NoticeCode, Texels, Wrap};

use crate::support::{folder, message, rgb, texts};

/// Model of a triangle whose material is defined by this MTL text, in a new folder with textures.
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
    texts(&model(mtl).unwrap().notices).join("\n")
}

#[test]
fn mtl_colours_and_shininess_are_read() {
    let model = model("newmtl m 1\nKd 0.5 0.25 0.125 # wood\nKs 0.1\nNs 40\nillum 2\nd 1\nTr 0\nKe 0 0 0\n").unwrap();
    assert!(model.notices.is_empty(), "{:?}", model.notices);
    let material = &model.materials[0];
    assert_eq!((&material.name[..], material.color), ("m 1", [0.5, 0.25, 0.125]));
    let MaterialModel::Phong { diffuse, specular, shininess } = material.model else { panic!() };
    assert_eq!((diffuse, specular, shininess), (1.0, [0.1; 3], 40.0));
}

#[test]
fn common_exporter_mistakes_in_mtl_are_corrected() {
    let model = model("newmtl m 1\nNi 0\nTr 1\nmap_Kd -colorspace sRGB wood.png\n").unwrap();
    assert_eq!(model.materials[0].opacity, 1.0);
    assert!(model.materials[0].texture.is_some());
    let [notice] = &model.notices[..] else {
        panic!("{:?}", model.notices);
    };
    assert_eq!(notice.code, NoticeCode::AssumedConvention, "{notice}");
    assert!(notice.to_string().contains(":3: Tr 1"), "{notice}");
    let found = notices("newmtl m 1\nmap_Kd -colorspace linear wood.png\n");
    assert!(found.contains("\"-colorspace linear\" is ignored"), "{found}");
}

#[test]
fn physically_based_keys_give_a_principled_material() {
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
    // In the file, (u, v) is mapped to (2 u + 0.5, 3 v + 0.25), with v upwards: (0.25, 0.75) is mapped to (1, 1.0) in
    // the mesh's convention.
    assert_eq!(color.coordinates([0.25, 0.75]), [1.0, 0.0]);
    assert!(matches!(image(color.texture).texels, Texels::Srgb8(_)));
    let normal = material.normal_map.unwrap();
    assert_eq!(normal.scale, 0.5);
    assert!(matches!(image(normal.texture.texture).texels, Texels::Linear8(_)));
    let roughness = principled.roughness.texture.unwrap();
    assert!(matches!(image(roughness.texture).texels, Texels::Linear8(_)));
}

#[test]
fn refracting_materials_become_glass() {
    let model = model("newmtl m 1\nKd 0 0 0\nTf 0.9 1 0.9\nNi 1.6\nNs 998\nillum 7\nd 0.1\n").unwrap();
    let material = &model.materials[0];
    let MaterialModel::Principled(principled) = &material.model else {
        panic!("{:?}", material.model);
    };
    assert_eq!((principled.transmission.value, principled.ior), (1.0, 1.6));
    // The exponent gives alpha^2 = 2 / 1000, and the roughness is the square root of alpha.
    assert!((principled.roughness.value - 0.002_f32.powf(0.25)).abs() < 1e-6);
    assert_eq!((material.color, material.alpha), ([0.9, 1.0, 0.9], Alpha::Opaque));
}

#[test]
fn reflectance_above_one_is_reduced() {
    let model = model("newmtl m 1\nKd 0.75 0.5 0\nKs 0.5 0.5 0.5\n").unwrap();
    let MaterialModel::Phong { specular, .. } = model.materials[0].model else { panic!() };
    assert_eq!(specular, [0.25, 0.5, 0.5]);
    assert!(
        model.notices[0].to_string().contains("my materials.mtl:1: material \"m 1\" reflects more light than arrives")
    );
    // Illumination model 1 has no highlights.
    assert_eq!(notices("newmtl m 1\nKd 0.75 0.5 0\nKs 0.5 0.5 0.5\nillum 1\n"), "");
}

#[test]
fn texture_names_in_every_notation_are_found() {
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

/// Texels of the model's only texture. Also checks that the material blends by the texture's alpha.
fn cut_out(maps: &str) -> Texels {
    let model = model(&format!("newmtl m 1\nKd 1 0.5 1\n{maps}\n")).unwrap();
    let material = &model.materials[0];
    assert_eq!((material.color, material.opacity, material.alpha), ([1.0, 0.5, 1.0], 1.0, Alpha::Blend));
    assert_eq!(model.textures.len(), 1, "the model must have only one image");
    assert_eq!(material.texture.map(|slot| slot.texture), Some(0));
    material.validate().unwrap();
    model.textures[0].image.texels.clone()
}

#[test]
fn opacity_maps_are_merged_into_the_colour_texture() {
    // In both orders of the maps, the opacity of a texel is the luminance of `grey.png`: 9 of 255 at both texels.
    let grey = Texels::Srgb8(vec![[255, 0, 0, 9], [0, 255, 0, 9]]);
    for maps in [
        "map_Kd wood.png\nmap_d grey.png",
        "map_d clear.png\nmap_d -imfchan l grey.png\nmap_Kd clear.png\nmap_Kd wood.png",
        "map_Kd wood.png\nmap_d ./textures\\..\\grey.png",
    ] {
        assert_eq!(cut_out(maps), grey, "{maps}");
    }
    // If both maps are the same image, the opacity is the image's own alpha, here 1.
    let both = Texels::Srgb8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]);
    assert_eq!(cut_out("map_Kd wood.png\nmap_d wood.png"), both);
    // An opacity image with alpha: the opacity is its alpha. Without a colour image, colours are white.
    let white = [[255, 255, 255, 255], [255, 255, 255, 51]];
    assert_eq!(cut_out("map_d clear.png"), Texels::Srgb8(white.into()));
    // An opacity image without alpha: the opacity is its luminance, here Rec. 709's weights of red and green.
    let shares = [[255, 255, 255, 54], [255, 255, 255, 182]];
    assert_eq!(cut_out("map_d wood.png"), Texels::Srgb8(shares.into()));
    // The colour image has one texel, the opacity image two.
    let nine = (65535.0 * linear_from_srgb(9.0 / 255.0)).round() as u16;
    let spread = [[nine, nine, nine, 65535], [nine, nine, nine, 13107]];
    let found = cut_out("map_Kd grey.png\nmap_d clear.png");
    assert_eq!(found, Texels::Linear16(spread.into()));
    // The options of both maps are applied. The merged texture does not replace the colour image in other uses.
    let clamped = model("newmtl m 1\nmap_Kd -clamp on wood.png\nmap_d -clamp on grey.png\n").unwrap();
    assert_eq!(clamped.textures[0].sampler.wrap, [Wrap::Clamp; 2]);
    let glowing = model("newmtl m 1\nmap_Kd wood.png\nmap_d grey.png\nmap_Ke wood.png\n").unwrap();
    let glow = glowing.materials[0].emission.texture.unwrap();
    let glow = &glowing.textures[glow.texture].image.texels;
    assert_eq!(glow, &Texels::Srgb8(vec![[255, 0, 0, 255], [0, 255, 0, 255]]));
    // If the opacity image is missing, the colours are unchanged.
    let model = model("newmtl m 1\nmap_Kd wood.png\nmap_d no.png\n").unwrap();
    assert_eq!(rgb(&model.textures[0]), [[255, 0, 0], [0, 255, 0]]);
    assert!(model.notices[0].to_string().contains("no.png: No such file"));
}

#[test]
fn merged_images_are_charged_to_the_budget() {
    for (pixels, fits) in [(6, true), (5, false)] {
        let budget = Budget { pixels, ..Budget::default() };
        let read = within(&budget, "newmtl m 1\nmap_Kd wood.png\nmap_d clear.png\n");
        assert_eq!(read.is_ok(), fits, "{pixels}");
    }
}

#[test]
fn ignored_mtl_statements_cause_notices() {
    let text = notices(
        "newmtl m 1\nTf 1 1 1\nNi 1.45\nmap_refl sky.png\nKd spectral file.rfl\nmap_Kd -mm 0.5 1 wood.png\n\
         d -halo 0.5\nmap_d -s 2 grey.png\n",
    );
    assert!(text.contains("map_Kd: option \"-mm 0.5 1\" is ignored"), "{text}");
    let expected = "ignored: map_refl (line 4), Kd spectral file.rfl (line 5), d -halo 0.5 (line 7)";
    assert!(text.contains(expected), "{text}");
    assert!(text.contains("mtl:8: map_d is ignored, because its options differ from map_Kd's"), "{text}");
    assert!(notices("newmtl m 1\nmap_Kd wood.png\nmap_d -clamp on grey.png\n").contains(":3: map_d is ignored"));
    assert!(
        notices("newmtl m 1\nNs -1.96\n")
            .contains(":2: Ns is \"-1.96\"; expected a number from 0 to 1000000; the value is clamped")
    );
    assert!(notices("newmtl m 1\nnorm grey.png\n").contains("\"grey.png\" is a height map without a unit"));
    assert!(notices("newmtl m 1\nmap_Kd\n").contains(":2: map_Kd without a file name"));
    assert!(notices("newmtl other\nKd 1 0 0\n").contains("materials without a definition get a default material: m 1"));
}

#[test]
fn missing_and_forbidden_files_are_omitted_with_a_notice() {
    let outside = folder().join("secret.png");
    fs::write(&outside, "x").unwrap();
    for (map, expected) in [
        ("no.png", "no.png: No such file"),
        ("textures", "textures: Is a directory"),
        ("../secret.png", "file name \"../secret.png\": it is outside the folder"),
        ("/etc/passwd", "file name \"/etc/passwd\": it is outside the folder"),
        ("file:///etc/passwd", "expected a path relative"),
        ("C:\\gone.png", "expected a path relative"),
        ("a.obj", "unknown image format"),
    ] {
        let model = model(&format!("newmtl m 1\nKd 0.5 0.5 0.5\nmap_Kd {map}\n")).unwrap();
        assert!(model.notices[0].to_string().contains(expected), "{map}: {:?}", model.notices);
        assert_eq!((model.textures.len(), model.materials[0].texture.map(|t| t.texture)), (0, None));
    }
    let path = folder().join("a.obj");
    fs::write(&path, "mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n").unwrap();
    let world = load(&path, &Budget::default()).unwrap();
    assert!(
        world.notices[0].to_string().contains("omitted") && world.notices[0].to_string().contains("no.mtl"),
        "{:?}",
        world.notices
    );
    assert_eq!(world.materials[0].color, [0.8; 3]);
}

#[test]
fn invalid_mtl_values_are_clamped_or_ignored_with_one_notice_per_kind() {
    // Each case: statement, resulting colour, and consequence in the notice.
    for (text, color, done) in [
        ("Kd 1.2 0.5 0", [1.0, 0.5, 0.0], "clamped"),
        ("Kd 1 2 3", [1.0; 3], "clamped"),
        ("Kd -0.1 0 1e9", [0.0, 0.0, 1.0], "clamped"),
        ("Kd 255 255 255", [1.0; 3], "treated as 0 to 255"),
        ("Kd 51 0 255", [0.2, 0.0, 1.0], "treated as 0 to 255"),
        ("Kd 1 1", [0.8; 3], "ignored"),
        ("Kd nan 0 0", [0.8; 3], "ignored"),
        ("Kd -1.#IND 0 0", [0.8; 3], "ignored"),
        ("Kd 0.1 0.2 0.3 1", [0.1, 0.2, 0.3], "used without the fourth number"),
    ] {
        let model = model(&format!("newmtl m 1\n{text}\n{text}\n")).unwrap();
        assert_eq!(model.materials[0].color, color, "{text}");
        let [notice] = &model.notices[..] else { panic!("{:?}", model.notices) };
        let value = text.strip_prefix("Kd ").unwrap();
        let expected = format!("mtl:2, 3: Kd is {value:?}; expected 1 or 3 numbers from 0 to 1; the value is {done}");
        assert!(notice.to_string().ends_with(&expected), "{notice:?}");
    }
    let phong = |text: &str| match model(&format!("newmtl m 1\nKd 0 0 0\n{text}\n")).unwrap().materials[0].model {
        MaterialModel::Phong { specular, shininess, .. } => (specular, shininess),
        ref other => panic!("{other:?}"),
    };
    assert_eq!(phong("Ks 2"), ([1.0; 3], 32.0));
    assert_eq!(phong("Ks 0.5\nillum 0.0\nNs 7"), ([0.0; 3], 7.0));
    assert_eq!(phong("Ks 0.5\nillum 99"), ([0.5; 3], 32.0));
    assert_eq!(phong("Ns 1e9"), ([0.0; 3], 1e6));
    assert_eq!(phong("Ns many"), ([0.0; 3], 32.0));
    // Values that are almost opaque count as opaque, and 25 is not an index of refraction.
    let opaque = model("newmtl m 1\nd 1.000001\n").unwrap();
    assert_eq!((opaque.materials[0].opacity, opaque.materials[0].alpha), (1.0, Alpha::Opaque));
    let glass = model("newmtl m 1\nillum 7\nNi 25\n").unwrap();
    let MaterialModel::Principled(principled) = &glass.materials[0].model else { panic!() };
    assert_eq!(principled.ior, 1.5);
    // `-s` reads the file name as its scale, so the file name is missing.
    assert!(notices("newmtl m 1\nmap_Kd -s wood.png\n").contains("map_Kd without a file name"));
}

#[test]
fn utf_16_libraries_are_read() {
    let text = "newmtl m 1\nKd 0 1 0\n";
    let folder = folder();
    let path = folder.join("a.obj");
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m 1\nf 1 2 3\n").unwrap();
    for bytes in [
        [&[0xff, 0xfe][..], &text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>()].concat(),
        text.encode_utf16().flat_map(u16::to_be_bytes).collect(),
    ] {
        fs::write(folder.join("a.mtl"), bytes).unwrap();
        assert_eq!(read_model(&path, &Budget::default()).unwrap().materials[0].color, [0.0, 1.0, 0.0]);
    }
}

/// Reads a triangle in each of these materials, with a library `a.mtl` of this text in the same folder.
fn named(head: &str, names: &[&[u8]], mtl: &[u8]) -> MeshFile {
    let folder = folder();
    let path = folder.join("a.obj");
    let mut text = format!("{head}v 0 0 0\nv 1 0 0\nv 0 1 0\n").into_bytes();
    for name in names {
        text.extend([name, &b"\nf 1 2 3\n"[..]].concat());
    }
    fs::write(&path, text).unwrap();
    fs::write(folder.join("a.mtl"), mtl).unwrap();
    read_model(&path, &Budget::default()).unwrap()
}

#[test]
fn material_names_may_have_any_encoding() {
    // The names "red" and "blue" in GBK. Converted to UTF-8, both become the same replacement characters.
    let (red, blue) = (b"\xba\xec", b"\xc0\xb6");
    let mtl = [b"newmtl ", &red[..], b"\nKd 1 0 0\nnewmtl ", blue, b"\nKd 0 0 1\n"].concat();
    let uses = [red, blue].map(|name| [&b"usemtl "[..], name].concat());
    let model = named("mtllib a.mtl\n", &[&uses[0], &uses[1]], &mtl);
    let colors: Vec<_> = model.materials.iter().map(|material| material.color).collect();
    assert_eq!(colors, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(model.parts[0].mesh.material_slots.as_deref(), Some(&[0, 1][..]));
    assert!(model.notices.is_empty(), "{:?}", model.notices);
    // Texture files may have such names too.
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;

        let folder = folder();
        let png = raycam_formats::encode::png::encode([1, 1], 3, raycam_formats::encode::png::Samples::U8(&[9; 3]));
        fs::write(folder.join(std::ffi::OsStr::from_bytes(b"\xba\xec.png")), png.unwrap()).unwrap();
        let library = [b"newmtl m\nmap_Kd ", &red[..], b".png\n"].concat();
        fs::write(folder.join(std::ffi::OsStr::from_bytes(b"\xc0.mtl")), library).unwrap();
        let text = b"mtllib \xc0.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
        fs::write(folder.join("a.obj"), text).unwrap();
        let model = read_model(&folder.join("a.obj"), &Budget::default()).unwrap();
        assert_eq!(rgb(&model.textures[0]), [[9; 3]]);
        assert!(model.notices.is_empty(), "{:?}", model.notices);
    }
}

#[test]
fn materials_are_found_under_slightly_different_names() {
    let red = b"newmtl Red\nKd 1 0 0\n";
    let two = b"newmtl Red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n";
    let (plain, scarlet) = ([0.8; 3], [1.0, 0.0, 0.0]);
    for (head, name, mtl, color, said) in [
        ("mtllib a.mtl\n", "g x", &red[..], scarlet, "no usemtl; the only material of its library, \"Red\", is used"),
        ("mtllib a.mtl\n", "g x", two, plain, "no usemtl, so none of the 2 materials of its library is used"),
        ("", "usemtl Red", two, scarlet, "no mtllib;"),
        ("mtllib gone.mtl\n", "usemtl Red", two, scarlet, "the file named in mtllib is missing;"),
        (
            "mtllib a.mtl\n",
            "usemtl red",
            two,
            scarlet,
            "materials found by their names in different upper and lower case: red",
        ),
        ("mtllib A.MTL\n", "usemtl Red", two, scarlet, "the same name with different upper and lower case"),
        ("mtllib a.mtl # of it\n", "usemtl Red # dark", two, scarlet, ""),
        ("mtllib a.mtl\n", "usemtl Red", b"newmtl Red\nnewmtl Red # again\nKd 1 0 0\n", plain, ""),
        ("mtllib a.mtl\n", "usemtl Red", b"newmtl Red\nnewmtl Red\nKd 1 0 0\n", scarlet, "is defined more than once"),
    ] {
        let model = named(head, &[name.as_bytes()], mtl);
        assert_eq!(model.materials[0].color, color, "{head}{name}");
        match said {
            "" => assert!(model.notices.is_empty(), "{:?}", model.notices),
            said => {
                assert!(
                    model.notices.iter().any(|notice| notice.to_string().contains(said)),
                    "{said}: {:?}",
                    model.notices
                )
            }
        }
    }
}

#[test]
fn images_are_searched_inside_the_root_in_the_documented_order() {
    for (map, found, how) in [
        ("WOOD.PNG", "wood.png", "the same name with different upper and lower case"),
        ("Textures/MY wood.png", "textures/my wood.png", "the same name with different upper and lower case"),
        ("C:\\me\\textures\\my wood.png", "textures/my wood.png", "found relative to the folder of the file"),
        ("C:\\me\\maps\\wood.png", "wood.png", "found relative to the folder of the file"),
        ("/home/me/wood.png", "wood.png", "found relative to the folder of the file"),
        ("../materials/textures/Wood.png", "wood.png", "with different upper and lower case"),
        ("http://example.com/wood.png", "wood.png", "found relative to the folder of the file"),
        ("my wood.png", "textures/my wood.png", "found in one of the folders that often contain images"),
        ("wood.png # oak", "", ""),
    ] {
        let model = model(&format!("newmtl m 1\nmap_Kd {map}\n")).unwrap();
        assert_eq!(rgb(&model.textures[0]), [[255, 0, 0], [0, 255, 0]], "{map}");
        let said = texts(&model.notices).join("\n");
        assert!(said.contains(how) && said.contains(found) && said.is_empty() == how.is_empty(), "{map}: {said}");
    }
}

#[test]
fn undecodable_images_are_omitted() {
    let png = raycam_formats::encode::png::encode([8, 8], 1, raycam_formats::encode::png::Samples::U8(&[9; 64]));
    let png = png.unwrap();
    let folder = folder();
    let path = folder.join("a.obj");
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n").unwrap();
    fs::write(folder.join("a.mtl"), "newmtl m\nKd 0 0 1\nmap_Kd a.png\nmap_d a.png\n").unwrap();
    for (bytes, said) in [
        (&png[..png.len() / 2], "omitted"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n", "git lfs pull"),
        (b"<!DOCTYPE html><html></html>", "HTML page"),
        (b"", "empty"),
        (b"DDS |", "unknown image format"),
    ] {
        fs::write(folder.join("a.png"), bytes).unwrap();
        let model = read_model(&path, &Budget::default()).unwrap();
        assert_eq!((model.parts[0].mesh.triangles.len(), model.textures.len()), (1, 0));
        assert_eq!(model.materials[0].color, [0.0, 0.0, 1.0]);
        assert!(model.notices[0].to_string().contains(said), "{:?}", model.notices);
    }
}

#[test]
fn tiled_images_are_reported() {
    let png =
        raycam_formats::encode::png::encode([1, 1], 3, raycam_formats::encode::png::Samples::U8(&[9; 3])).unwrap();
    let folder = folder();
    let path = folder.join("a.obj");
    fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n").unwrap();
    let read = |map: &str| {
        fs::write(folder.join("a.mtl"), format!("newmtl m\nmap_Kd {map}\n")).unwrap();
        let model = read_model(&path, &Budget::default()).unwrap();
        (model.textures.len(), texts(&model.notices).join("\n"))
    };
    fs::write(folder.join("a_1001.png"), &png).unwrap();
    assert_eq!(read("a_<UDIM>.png"), (1, String::new()), "the only tile is the image");
    assert_eq!(read("a_1001.png"), (1, String::new()));
    assert!(read("b.<UDIM>.png").1.contains("no tile (UDIM) from 1001 to 1099 exists"));
    fs::write(folder.join("a_1012.png"), &png).unwrap();
    let (count, said) = read("a_<UDIM>.png");
    assert!(count == 0 && said.contains("the tiles (UDIM) 1001, 1012 are not supported; bake them"), "{said}");
    let (count, said) = read("a_1001.png");
    assert!(count == 1 && said.contains("its other tiles (UDIM) are ignored: 1012"), "{said}");
}
