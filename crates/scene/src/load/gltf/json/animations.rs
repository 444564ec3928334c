//! Animations.

use super::list::List;
use serde::Deserialize;

#[derive(Deserialize)]
pub struct Animation {
    pub name: Option<String>,
    #[serde(default)]
    pub channels: List<Channel>,
    #[serde(default)]
    pub samplers: List<AnimationSampler>,
}

#[derive(Deserialize)]
pub struct Channel {
    pub sampler: u32,
    pub target: ChannelTarget,
}

#[derive(Deserialize)]
pub struct ChannelTarget {
    pub node: Option<u32>,
    #[serde(default)]
    pub path: String,
    #[serde(default)]
    pub extensions: ChannelExtensions,
}

#[derive(Default, Deserialize)]
pub struct ChannelExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<AnimationPointer>,
}

#[derive(Deserialize)]
pub struct AnimationPointer {
    #[serde(default)]
    pub pointer: String,
}

#[derive(Deserialize)]
pub struct AnimationSampler {
    pub input: u32,
    pub output: u32,
    pub interpolation: Option<String>,
}
