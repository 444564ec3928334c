//! The passes: their texts and what they bind.

use super::matrices;
use super::products::{Numbers, Products};
use crate::bindings::PassBinding::{self, Read, Uniform, Write};
use crate::pass::{self, Pass, PassSpec};
use crate::shader::Linkage;
use crate::{Gpu, GpuError, MatrixUnits};

/// A pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassId {
    /// What the network sees.
    Features,
    /// A convolution with so many outputs.
    Convolve(u32),
    /// The finest level of what is filtered.
    Trust,
    /// A level of half the resolution.
    Halve,
    /// Kernels at work.
    Filter,
    /// A level with the next coarser one's result.
    Combine,
    /// The filtered picture.
    Finish,
}

/// Output channels of convolutions.
const OUTPUTS: [u32; 4] = [48, 64, 80, 96];

impl PassId {
    /// All that there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let others = [Self::Features, Self::Trust, Self::Halve, Self::Filter, Self::Combine, Self::Finish];
        others.into_iter().chain(OUTPUTS.map(Self::Convolve))
    }

    /// What it is.
    pub fn spec(self, products: Products) -> PassSpec {
        const TO_2: &[PassBinding] = &[Uniform(0), Read(1), Write(2)];
        const COMBINE: &[PassBinding] = &[Uniform(0), Read(2), Read(3), Write(4)];
        const TRUST: &[PassBinding] = &[Uniform(0), Read(1), Read(3), Read(4), Write(5)];
        const TO_5: &[PassBinding] = &[Uniform(0), Read(1), Read(2), Read(3), Read(4), Write(5)];
        let (name, module, entry_point, own) = match self {
            Self::Features => ("features", "denoise_features", "find_features", TO_2),
            Self::Convolve(_) => {
                let module = match products {
                    Products::Lanes(_) => "denoise_lanes",
                    Products::Matrices(_) => "denoise_products",
                };
                ("convolution", module, "convolve", TO_5)
            }
            Self::Trust => ("trust", "denoise_trust", "find_trust", TRUST),
            Self::Halve => ("coarser level", "denoise_coarser", "halve", TO_2),
            Self::Filter => ("kernels", "denoise_kernels", "filter_level", TO_5),
            Self::Combine => ("levels", "denoise_combine", "combine", COMBINE),
            Self::Finish => ("result", "denoise_result", "finish", TO_5),
        };
        PassSpec { name, own, ..PassSpec::new(module, entry_point) }
    }

    /// What its text is linked with.
    pub fn linkage(self, products: Products) -> Linkage {
        let linkage = match products.numbers() {
            Numbers::Half => Linkage::default().define("DENOISE_HALF"),
            Numbers::Full => Linkage::default(),
        };
        match (self, products) {
            (Self::Convolve(outputs), Products::Matrices(units)) => linkage
                .generate("denoise_shape", shape(outputs, Some(units)))
                .generate("denoise_products", matrices::products(outputs)),
            (Self::Convolve(outputs), Products::Lanes(_)) => {
                linkage.generate("denoise_shape", shape(outputs, None))
            }
            _ => linkage,
        }
    }
}

/// The module `denoise_shape`: output channels of a convolution, and invocations of a subgroup.
pub fn shape(outputs: u32, units: Option<MatrixUnits>) -> String {
    let subgroup_size = units.map_or(1, |units| units.subgroup_size);
    format!("const OUTPUTS: u32 = {outputs}u;\nconst SUBGROUP_SIZE: u32 = {subgroup_size}u;\n")
}

/// All passes, compiled.
pub struct Passes(Vec<(PassId, Pass)>);

impl Passes {
    /// Compiles them, linked with what `linkage` says, such as [`PassId::linkage`].
    ///
    /// # Errors
    /// When the driver refuses one.
    pub fn new(gpu: &Gpu, products: Products, linkage: impl Fn(PassId) -> Linkage) -> Result<Self, GpuError> {
        let make =
            |id: PassId| Ok((id, Pass::new(gpu, "denoiser's", id.spec(products), &linkage(id), None, None)?));
        let mut passes = PassId::all().map(make).collect::<Result<Vec<_>, GpuError>>()?;
        pass::compile(gpu, passes.iter_mut().map(|(_, pass)| pass))?;
        Ok(Self(passes))
    }

    /// One of them.
    pub fn get(&self, id: PassId) -> Option<&Pass> {
        self.0.iter().find(|(other, _)| *other == id).map(|(_, pass)| pass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::check::{check_bindings, check_pass};
    use naga::back::spv;

    #[test]
    fn passes_bind_what_their_shaders_use() {
        for (id, numbers) in PassId::all().flat_map(|id| [Numbers::Half, Numbers::Full].map(|n| (id, n))) {
            let products = Products::Lanes(numbers);
            check_pass(&id.spec(products), &id.linkage(products), &format!("{id:?}, {numbers:?}"));
        }
    }

    /// Only Vulkan has matrix units so.
    #[test]
    fn products_of_matrices_can_be_written() {
        let products = Products::Matrices(MatrixUnits { subgroup_size: 32 });
        for id in OUTPUTS.map(PassId::Convolve) {
            let (module, info) =
                check_bindings(&id.spec(products), &id.linkage(products), &format!("{id:?}"));
            let words = spv::write_vec(&module, &info, &spv::Options::default(), None);
            assert!(words.is_ok_and(|words| words.len() > 1000), "{id:?}");
        }
    }
}
