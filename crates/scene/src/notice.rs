//! Notices: assumptions, changes and omissions that did not stop the work.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fmt;

use crate::codes::codes;

/// Maximum number of subjects that a notice lists; further subjects are only counted.
const MAX_SUBJECTS: usize = 3;

/// A notice. Programs should test its code; the message is for people.
#[derive(Clone, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Notice {
    /// Kind of the notice.
    pub code: NoticeCode,
    /// The assumption, change or omission.
    pub message: String,
    /// The first parts that the notice concerns, such as `camera "left"`; empty if the message names them.
    pub subjects: Vec<String>,
    /// Number of parts that the notice concerns, including parts that are not listed.
    pub count: usize,
}

impl Notice {
    /// Creates a notice of this kind.
    pub fn new(code: NoticeCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), subjects: Vec::new(), count: 0 }
    }

    /// Creates a notice about a part, such as a camera, a key or a line.
    pub fn about(code: NoticeCode, subject: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), subjects: vec![subject.into()], count: 1 }
    }

    /// Creates a notice about several parts, of which it lists the first three.
    pub fn about_all<S: Into<String>>(
        code: NoticeCode,
        subjects: impl ExactSizeIterator<Item = S>,
        message: impl Into<String>,
    ) -> Self {
        let count = subjects.len();
        Self { code, message: message.into(), subjects: subjects.take(MAX_SUBJECTS).map(Into::into).collect(), count }
    }

    /// Returns the notice with `place` and a colon before its first subject. Without subjects, `place` becomes the
    /// subject.
    #[must_use]
    pub fn in_context(mut self, place: impl fmt::Display) -> Self {
        match self.subjects.first_mut() {
            Some(subject) => *subject = format!("{place}: {subject}"),
            None => (self.subjects, self.count) = (vec![place.to_string()], 1),
        }
        self
    }

    /// Merges notices with the same code whose messages differ at most in counts. The first message is kept, with the
    /// first three subjects and the number of the remaining ones.
    pub fn group(notices: impl IntoIterator<Item = Self>) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        let mut known = HashMap::new();
        for notice in notices {
            match known.entry((notice.code, cause(&notice.message), notice.subjects.is_empty())) {
                Entry::Vacant(entry) => {
                    entry.insert(groups.len());
                    groups.push(notice);
                }
                Entry::Occupied(entry) => {
                    let group: &mut Self = &mut groups[*entry.get()];
                    let left = MAX_SUBJECTS.saturating_sub(group.subjects.len());
                    group.subjects.extend(notice.subjects.into_iter().take(left));
                    group.count += notice.count;
                }
            }
        }
        groups
    }
}

/// The message with `#` in place of numbers that are separate words.
fn cause(message: &str) -> String {
    let masked = |word: &str| {
        let number = word.trim_matches(|c: char| c.is_ascii_punctuation() && c != '-');
        match number.parse::<f64>() {
            Ok(_) => word.replace(number, "#"),
            Err(_) => word.to_owned(),
        }
    };
    message.split(' ').map(masked).collect::<Vec<_>>().join(" ")
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.subjects.is_empty() {
            f.write_str(&self.subjects.join(", "))?;
            match self.count - self.subjects.len() {
                0 => f.write_str(": ")?,
                more => write!(f, " and {more} more: ")?,
            }
        }
        f.write_str(&self.message)
    }
}

codes! {
    /// Kind of a notice. The documentation of each variant states the cause and what to do.
    NoticeCode {
        DefaultLights "default_lights":
            "The world has no lights, so a white sky and a sun light it.",
            "Add a light to the world, or use the integrator \"flat\", which requires none.";
        GlassBlocksLight "glass_blocks_light":
            "The light of lamps and suns without a size does not pass through solid glass.",
            "Give the lamp a radius or the sun an angular_diameter.";
        SamplesUsed "samples_used":
            "A render with a noise threshold or a time limit used this number of samples per pixel.",
            "To reproduce an image after a time limit, set samples to this number.";
        NoiseLeft "noise_left":
            "Some pixels have not reached the noise threshold within the allowed samples.",
            "Raise samples or noise_threshold.";
        TooBrightSamples "too_bright_samples":
            "Some samples were too bright for float32 and count as black.",
            "Reduce the strength of the lights.";
        ClampedSamples "clamped_samples":
            "Some samples were brighter than clamp and were reduced, so the image is too dark.",
            "Raise clamp, or remove it for an unbiased image.";
        CoplanarSurfaces "coplanar_surfaces":
            "Pixels show surfaces of several objects in the same plane, up to rounding to float32; the last object is shown.",
            "Move the objects apart, or remove the surface that must not be visible.";
        CoarseMotionBlur "coarse_motion_blur":
            "Objects move by more than a pixel between two of the moments that motion blur averages.",
            "Shorten the exposure, or render shorter exposures and average the images.";
        ExceededTextureMemory "exceeded_texture_memory":
            "The textures require more than texture_memory and are in a temporary file.",
            "Raise texture_memory if rendering is slow.";
        TexturesPaged "textures_paged":
            "Texture tiles were read back from the temporary file during rendering.",
            "Raise texture_memory to render faster.";
        ReflectanceAboveOne "reflectance_above_one":
            "A material reflects more light than arrives.",
            "Reduce its diffuse or specular reflectance, or its color.";
        IgnoredKey "ignored_key":
            "A key, statement, property or option is ignored.",
            "Remove it, or check its spelling if it should have an effect.";
        IgnoredFeature "ignored_feature":
            "A feature of a file is not supported, and the file is read without it.",
            "Export the file without the feature, or accept the difference.";
        IgnoredElement "ignored_element":
            "A part of a file, such as a mesh, light or camera, is omitted because it is invalid or not supported.",
            "If the part matters, repair it in the program that wrote the file.";
        IgnoredColors "ignored_colors":
            "Some of an object's colours are ignored because another source of colour has priority.",
            "Remove the source of colour that should not be shown.";
        IgnoredColorProfile "ignored_color_profile":
            "An image's colour profile, primaries, gamma or exposure is not applied.",
            "Convert the image to sRGB (or linear Rec. 709 if it stores float values).";
        IgnoredOrientation "ignored_orientation":
            "An image's EXIF orientation is not applied.",
            "Rotate the pixels of the image instead.";
        IgnoredTransparency "ignored_transparency":
            "Transparency that a file stores is not shown.",
            "Set alpha for the object, or accept that it is opaque.";
        UnusedAlpha "unused_alpha":
            "A texture has an alpha channel that its material ignores.",
            "Set alpha = \"blend\" for the object, or map_d in an MTL file.";
        IgnoredAnimation "ignored_animation":
            "A part of an animation has no effect, or its target cannot be animated.",
            "Animate another property, or accept that it does not move.";
        FirstOnly "first_only":
            "A file contains several images, frames, scenes or sets of values, and only one is used.",
            "Save the required part to a separate file.";
        EmptyFile "empty_file":
            "A file contains nothing that can be shown.",
            "Check which types of objects the program that wrote it exports.";
        HiddenPart "hidden_part":
            "A file marks a part as hidden, and it is not shown.",
            "Make it visible in the program that wrote the file.";
        MultipliedColors "multiplied_colors":
            "Two sources of colour are multiplied.",
            "To show only one source, set the colours of the other source to white.";
        MissingFile "missing_file":
            "A file that another file refers to is missing, or must not be read, and is skipped.",
            "Put the file inside the folder of the file that refers to it.";
        OutsideRoot "outside_root":
            "A file that another file refers to is outside the folder from which files may be read, and is skipped.",
            "Load with the folder= that the message contains, or put the file into the folder.";
        UnreadableFile "unreadable_file":
            "A file that another file refers to is damaged or has an unknown format, and is skipped.",
            "Repair or convert the file.";
        SubstitutedFile "substituted_file":
            "A file was found under a different name or folder than specified.",
            "Correct the name in the file that refers to it.";
        ClampedValue "clamped_value":
            "A value was outside its range and was replaced by the nearest limit.",
            "Correct the value.";
        ReplacedValue "replaced_value":
            "A value was invalid and was replaced by a default.",
            "Correct the value.";
        DroppedGeometry "dropped_geometry":
            "Faces, points or lines were omitted because they have no area or invalid vertices.",
            "Repair the mesh if the faces matter.";
        RepairedRotation "repaired_rotation":
            "A matrix that is almost a rotation was replaced by the nearest rotation.",
            "Write poses with more digits to keep their exact values.";
        RepairedPose "repaired_pose":
            "Scale, shear or mirroring was removed from a camera's or light's pose.",
            "Apply the scale to the meshes instead.";
        TrailingData "trailing_data":
            "Data after the declared end of the file is ignored.",
            "Check the counts that the file declares.";
        TruncatedData "truncated_data":
            "A file is truncated, and only the existing part is used.",
            "Copy or download the file again.";
        InvalidFile "invalid_file":
            "A file violates its format, but can still be read.",
            "Report the violation to the developers of the program that wrote the file.";
        DuplicateName "duplicate_name":
            "A name is defined twice, and only one of the definitions is used.",
            "Rename one of them.";
        MissingColors "missing_colors":
            "Parts without a colour are shown in a default colour.",
            "Assign a colour to each part.";
        MissingValue "missing_value":
            "A value is missing and its default is used.",
            "Specify the value if the default is wrong.";
        ConvertedUpAxis "converted_up_axis":
            "A model's up axis differs from the world's, and the model is rotated.",
            "Set upright = false to keep the model's axes.";
        AssumedConvention "assumed_convention":
            "A file does not specify a unit, an axis, a scale or a convention, and one was assumed.",
            "If the assumption is wrong, specify the convention with an argument.";
        PlacedCameras "placed_cameras":
            "The file determines the axes, the origin or the unit of the camera poses.",
            "Move the cameras, or load the world in the same axes and unit.";
        RectifiedValues "rectified_values":
            "A file describes both the raw and the rectified cameras, and one of them is used.",
            "Use rig.rectified() for the rectified cameras of a raw pair.";
        UsedOtherFile "used_other_file":
            "Values that a file does not contain, such as K or an image size, were read from another file.",
            "If the values are wrong, pass the other file or the values as an argument.";
        ApproximatedValue "approximated_value":
            "A value is represented by a similar one because the original has no exact equivalent.",
            "Compare the result with the original if the difference matters.";
        NotWritten "not_written":
            "A file format cannot store a value, which is not written.",
            "Use another format, or store the value elsewhere.";
        Renamed "renamed":
            "A name was changed in the written file because the format prescribes names.",
            "Use the new name to find the part in the written file.";
        DetachedPart "detached_part":
            "A change detached a part from the animation of its file.",
            "To keep the animation, choose a time with world.at(time) before making the change.";
        Implausible "implausible":
            "A value is valid but probably a mistake, such as a principal point outside the image.",
            "Check the value, and its unit or resolution.";
        OpenMedium "open_medium":
            "An object has a medium inside, but its mesh is not closed, so that no inside is defined.",
            "Close the mesh.";
        UnusedOption "unused_option":
            "An option has no effect in this call.",
            "Remove the option.";
        MoreNotices "more_notices":
            "A file causes so many different notices that only some of them are kept.",
            "Resolve the listed notices first.";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn group_lists_three_subjects_and_counts_the_others() {
        let code = NoticeCode::RepairedRotation;
        let of = |i: usize| Notice::about(code, format!("camera {i}"), format!("off by {}e-7", i + 1));
        let others =
            [Notice::new(code, "2 more"), Notice::new(NoticeCode::IgnoredKey, "2 more"), Notice::new(code, "3 more")];
        let texts: Vec<_> = Notice::group((0..1833).map(of).chain(others)).iter().map(Notice::to_string).collect();
        assert_eq!(texts, ["camera 0, camera 1, camera 2 and 1830 more: off by 1e-7", "2 more", "2 more"]);
    }

    #[test]
    fn grouping_does_not_merge_notices_whose_names_differ_in_digits() {
        let notices = ["cam0 is wide", "cam1 is wide", "K is 3.5, not 4", "K is 7, not 9.25"];
        let kept = Notice::group(notices.map(|message| Notice::new(NoticeCode::Implausible, message)));
        assert_eq!(kept.iter().map(Notice::to_string).collect::<Vec<_>>(), notices[..3]);
    }

    #[test]
    fn codes_have_unique_names_causes_and_remedies() {
        let all = NoticeCode::ALL;
        assert!(all.iter().all(|code| code.cause().ends_with('.') && code.remedy().ends_with('.')));
        for text in [NoticeCode::name, NoticeCode::cause] {
            let mut texts: Vec<_> = all.iter().map(|code| text(*code)).collect();
            texts.sort_unstable();
            texts.dedup();
            assert_eq!(texts.len(), all.len());
        }
    }
}
