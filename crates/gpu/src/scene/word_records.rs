//! Records that lie in `words`, where shaders have no structure to point at: WGSL functions that read them field by
//! field, made from the records' declarations.

use naga::{Scalar, ScalarKind, TypeInner, VectorSize};
use optics::WgslRecord;
use optics::image_texture::TextureUse;
use optics::layers::LayersRecord;
use optics::texture_node::TextureNode;
use std::fmt::Write;
use std::sync::LazyLock;

/// `read_LayersRecord(at)` returns the record that begins at word `at`.
pub fn layer_readers() -> &'static str {
    static TEXT: LazyLock<String> =
        LazyLock::new(|| module::<LayersRecord, _>("layers", optics::layers::WGSL_SOURCE.wgsl_source()));
    &TEXT
}

/// As [`layer_readers`]: `read_TextureUse(at)`.
pub fn use_readers() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        module::<TextureUse, _>("image_texture", optics::image_texture::WGSL_SOURCE.wgsl_source())
    });
    &TEXT
}

/// As [`layer_readers`]: `read_TextureNode(at)`.
pub fn node_readers() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        module::<TextureNode, _>("texture_node", optics::texture_node::WGSL_SOURCE.wgsl_source())
    });
    &TEXT
}

/// A module with the function that reads a record which the module `declares` of the optics declares; `text`: of that
/// module with all that it imports.
fn module<T: WgslRecord, E: std::fmt::Debug>(declares: &str, text: Result<String, E>) -> String {
    let declarations = text.expect("a test builds the text of every module");
    format!("#import scene\n#import optics::{declares}\n\n{}", reader::<T>(&declarations))
}

/// A function that reads a record; `declarations`: WGSL that declares it.
fn reader<T: WgslRecord>(declarations: &str) -> String {
    let module = naga::front::wgsl::parse_str(declarations).expect("a test parses the text of every module");
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(T::NAME));
    let Some((_, naga::Type { inner: TypeInner::Struct { members, .. }, .. })) = found else {
        unreachable!("the text declares {}", T::NAME)
    };
    let mut text = format!("fn read_{name}(at: u32) -> {name} {{\n    return {name}(", name = T::NAME);
    for member in members {
        let word = member.offset / 4;
        // Writing to a string cannot fail.
        let _ = match module.types[member.ty].inner {
            TypeInner::Scalar(Scalar { kind: ScalarKind::Float, .. }) => {
                write!(text, "word_f32(at + {word}u), ")
            }
            TypeInner::Scalar(Scalar { kind: ScalarKind::Sint, .. }) => {
                write!(text, "bitcast<i32>(words[at + {word}u]), ")
            }
            TypeInner::Scalar(_) => write!(text, "words[at + {word}u], "),
            TypeInner::Vector { size: VectorSize::Bi, .. } => write!(text, "words_vec2(at + {word}u), "),
            TypeInner::Vector { size: VectorSize::Tri, .. } => write!(text, "words_vec3(at + {word}u), "),
            TypeInner::Vector { size: VectorSize::Quad, .. } => write!(text, "words_vec4(at + {word}u), "),
            ref other => unreachable!("no record in words has a field of type {other:?}"),
        };
    }
    text.truncate(text.len() - 2);
    text + ");\n}\n\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_read_in_their_order_from_their_places() {
        let text = layer_readers();
        assert!(text.contains("fn read_LayersRecord(at: u32) -> LayersRecord"), "{text}");
        let use_ = use_readers();
        assert!(
            use_.contains("words_vec3(at + 0u), words[at + 3u], words_vec3(at + 4u), words[at + 7u]"),
            "{use_}"
        );
    }
}
