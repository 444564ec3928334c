//! Whether a device multiplies matrices: tensor cores and their like.

use wgpu::{CooperativeMatrixProperties, CooperativeScalarType, Features};

/// Rows and columns of matrices.
pub(crate) const SIDE: u32 = 16;

/// A device's matrix units: its subgroups multiply matrices of 16×16 16-bit floats, with sums in 32
/// bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatrixUnits {
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
}

/// What devices need to use their matrix units.
pub(crate) const MATRIX_FEATURES: Features =
    Features::EXPERIMENTAL_COOPERATIVE_MATRIX.union(Features::SHADER_F16).union(Features::SUBGROUP);

impl MatrixUnits {
    /// Those of an adapter of which `features` may be used. None where the driver chooses the size
    /// of subgroups.
    pub(crate) fn of(adapter: &wgpu::Adapter, features: Features) -> Option<Self> {
        let wanted = CooperativeMatrixProperties {
            m_size: SIDE,
            n_size: SIDE,
            k_size: SIDE,
            ab_type: CooperativeScalarType::F16,
            cr_type: CooperativeScalarType::F32,
            saturating_accumulation: false,
        };
        let info = adapter.get_info();
        let has_one_size = info.subgroup_min_size == info.subgroup_max_size;
        let has_units = features.contains(MATRIX_FEATURES)
            && has_one_size
            && adapter.cooperative_matrix_properties().contains(&wanted);
        has_units.then_some(Self { subgroup_size: info.subgroup_max_size })
    }
}
