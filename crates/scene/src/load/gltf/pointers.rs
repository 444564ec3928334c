//! `KHR_animation_pointer`: JSON pointers to the values that animations may change.

use super::animations::{FileTarget, NodeValue};
use crate::animation::{CameraValue, LightValue, MaterialValue, TextureUse};

/// What a pointer points to; `None` for what has no effect on the picture here.
pub(super) fn parse(pointer: &str) -> Option<FileTarget> {
    let mut parts = pointer.strip_prefix('/')?.split('/');
    let list = parts.next()?;
    if list == "extensions" {
        if (parts.next()?, parts.next()?) != ("KHR_lights_punctual", "lights") {
            return None;
        }
        let index = parts.next()?.parse().ok()?;
        return light_value(&parts.collect::<Vec<_>>()).map(|value| FileTarget::Light(index, value));
    }
    let index = parts.next()?.parse().ok()?;
    let rest: Vec<&str> = parts.collect();
    match list {
        "nodes" => node_value(&rest).map(|value| FileTarget::Node(index, value)),
        "meshes" => match rest[..] {
            ["weights"] => Some(FileTarget::Mesh(index, None)),
            ["weights", one] => Some(FileTarget::Mesh(index, Some(one.parse().ok()?))),
            _ => None,
        },
        "materials" => material_value(&rest).map(|value| FileTarget::Material(index, value)),
        "cameras" => camera_value(&rest).map(|value| FileTarget::Camera(index, value)),
        _ => None,
    }
}

fn node_value(path: &[&str]) -> Option<NodeValue> {
    Some(match path {
        ["translation"] => NodeValue::Translation,
        ["rotation"] => NodeValue::Rotation,
        ["scale"] => NodeValue::Scale,
        ["weights"] => NodeValue::Weights(None),
        ["weights", one] => NodeValue::Weights(Some(one.parse().ok()?)),
        ["extensions", "KHR_node_visibility", "visible"] => NodeValue::Visible,
        _ => return None,
    })
}

fn light_value(path: &[&str]) -> Option<LightValue> {
    Some(match path {
        ["color"] => LightValue::Color,
        ["intensity"] => LightValue::Intensity,
        ["spot", "innerConeAngle"] => LightValue::InnerConeAngle,
        ["spot", "outerConeAngle"] => LightValue::OuterConeAngle,
        _ => return None,
    })
}

fn camera_value(path: &[&str]) -> Option<CameraValue> {
    Some(match path {
        ["perspective", "yfov"] => CameraValue::FovY,
        ["orthographic", "ymag"] => CameraValue::HalfHeight,
        _ => return None,
    })
}

fn material_value(path: &[&str]) -> Option<MaterialValue> {
    Some(match path {
        ["pbrMetallicRoughness", "baseColorFactor"] => MaterialValue::BaseColor,
        ["pbrMetallicRoughness", "metallicFactor"] => MaterialValue::Metallic,
        ["pbrMetallicRoughness", "roughnessFactor"] => MaterialValue::Roughness,
        ["emissiveFactor"] => MaterialValue::EmissiveFactor,
        ["alphaCutoff"] => MaterialValue::AlphaCutoff,
        ["normalTexture", "scale"] => MaterialValue::NormalScale,
        ["extensions", "KHR_materials_emissive_strength", "emissiveStrength"] => {
            MaterialValue::EmissiveStrength
        }
        ["extensions", "KHR_materials_ior", "ior"] => MaterialValue::Ior,
        ["extensions", "KHR_materials_specular", "specularFactor"] => MaterialValue::Specular,
        ["extensions", "KHR_materials_transmission", "transmissionFactor"] => MaterialValue::Transmission,
        [texture @ .., "extensions", "KHR_texture_transform", value] => {
            let texture = texture_use(texture)?;
            match *value {
                "offset" => MaterialValue::TextureOffset(texture),
                "rotation" => MaterialValue::TextureRotation(texture),
                "scale" => MaterialValue::TextureScale(texture),
                _ => return None,
            }
        }
        _ => return None,
    })
}

fn texture_use(path: &[&str]) -> Option<TextureUse> {
    Some(match path {
        ["pbrMetallicRoughness", "baseColorTexture"] => TextureUse::BaseColor,
        ["pbrMetallicRoughness", "metallicRoughnessTexture"] => TextureUse::MetallicRoughness,
        ["normalTexture"] => TextureUse::Normal,
        ["emissiveTexture"] => TextureUse::Emission,
        ["extensions", "KHR_materials_transmission", "transmissionTexture"] => TextureUse::Transmission,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_of_the_specification_are_understood() {
        let scale = MaterialValue::TextureScale(TextureUse::Normal);
        for (pointer, target) in [
            ("/nodes/7/translation", FileTarget::Node(7, NodeValue::Translation)),
            ("/nodes/7/weights/2", FileTarget::Node(7, NodeValue::Weights(Some(2)))),
            ("/nodes/0/extensions/KHR_node_visibility/visible", FileTarget::Node(0, NodeValue::Visible)),
            ("/meshes/3/weights", FileTarget::Mesh(3, None)),
            ("/materials/1/emissiveFactor", FileTarget::Material(1, MaterialValue::EmissiveFactor)),
            (
                "/materials/1/normalTexture/extensions/KHR_texture_transform/scale",
                FileTarget::Material(1, scale),
            ),
            (
                "/extensions/KHR_lights_punctual/lights/4/spot/innerConeAngle",
                FileTarget::Light(4, LightValue::InnerConeAngle),
            ),
            ("/cameras/0/perspective/yfov", FileTarget::Camera(0, CameraValue::FovY)),
        ] {
            assert_eq!(parse(pointer), Some(target), "{pointer}");
        }
    }

    #[test]
    fn other_pointers_are_not() {
        for pointer in ["", "/", "nodes/0/scale", "/nodes/x/scale", "/nodes/0", "/nodes/0/name", "/skins/0/x"]
        {
            assert_eq!(parse(pointer), None, "{pointer}");
        }
    }
}
