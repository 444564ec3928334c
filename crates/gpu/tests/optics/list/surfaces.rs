//! Functions of `surface` and `materials`.

use super::*;

functions! {
    surfaces:
    // surface/fresnel.rs
    fresnel::f0_from_ior(eta: eta) within ROUNDING;
    fresnel::schlick_weight(cos_theta: cosine) within ROUNDING;
    fresnel::fresnel_dielectric(cos_incident: cosine, eta: eta) within ROUNDING;
    fresnel::thin_sheet_reflectance(reflectance: share) within ROUNDING;
    // surface/ggx.rs
    ggx::is_polished(roughness: share) within STEPS;
    ggx::ggx_d(h: upper, alpha: alpha) within ROUNDING;
    ggx::ggx_g1(cos_theta: cosine, alpha: alpha) within ROUNDING;
    ggx::ggx_g1_over_2cos(cos_theta: cosine, alpha: alpha) within ROUNDING;
    ggx::cap_bound(wo: upper, alpha: alpha) within ROUNDING;
    ggx::ggx_sample_reflection_half(wo: upper, alpha: alpha, u: unit2) within GRAZING;
    ggx::ggx_sample_visible_half(wo: upper, alpha: alpha, u: unit2) within GRAZING;
    ggx::cap_half(wo_std: upper, alpha: alpha, lower: signed_cosine, u: unit2) within GRAZING;
    ggx::ggx_reflection_pdf(wo: upper, h: upper, alpha: alpha) within ROUNDING;
    ggx::ggx_visible_half_pdf(wo: upper, h: upper, alpha: alpha) within ROUNDING;
    ggx::piecewise_log2(x: size) within ROUNDING;
    ggx::piecewise_exp2(y: signed_cosine) within ROUNDING;
    ggx::albedo_coordinates(cos_theta: cosine, alpha: alpha) within ROUNDING;
    ggx::albedo_eta_coordinate(eta: eta) within ROUNDING;
    ggx::dielectric_compensation(albedo: share) within ROUNDING;
    ggx::sheet_compensation(albedo: share2) within ROUNDING;
    ggx::albedo_parameters(coordinates: share2) within ROUNDING;
    // surface/scatter.rs
    scatter::no_sample() within EXACT;
    scatter::black_bsdf() within EXACT;
    // surface/phong.rs
    phong::phong_exponent(alpha: alpha) within ROUNDING;
    phong::phong_eval(b: glossy, wo: upper, wi: upper) within GRAZING;
    // surface/glossy.rs
    glossy::lambert_bsdf(albedo: albedo) within ROUNDING;
    glossy::mirror_bsdf(reflectance: albedo) within ROUNDING;
    glossy::metallic_roughness_bsdf(m: material, albedo: ggx_albedo, single_scatter: flag) within ROUNDING;
    glossy::glossy_reflectance(b: glossy, cos_o: cosine) within ROUNDING;
    glossy::glossy_eval(b: glossy, wo: upper, wi: upper) within GRAZING;
    glossy::glossy_sample(b: glossy, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    glossy::ggx_albedo_sample(cos_o: cosine, roughness: share, u: unit2) within GRAZING;
    // surface/dielectric.rs
    dielectric::dielectric_bsdf(tint: albedo, alpha: alpha, eta: eta, thin: flag, compensation: exposure) within ROUNDING;
    dielectric::transmitted_beam(b: bsdf, wo: upper, acceptance: unit) within GRAZING;
    dielectric::refract_at(wo: upper, h: upper, eta: eta, cos_transmitted: cosine) within ROUNDING;
    dielectric::smooth_dielectric_sample(b: smooth_dielectric, wo: upper, u_lobe: unit) within GRAZING;
    dielectric::rough_dielectric_eval(b: rough_dielectric, wo: upper, wi: direction) within GRAZING;
    dielectric::rough_dielectric_sample(b: rough_dielectric, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    dielectric::sheet_reflectance(b: thin_dielectric, cos_theta: cosine) within ROUNDING;
    dielectric::thin_dielectric_eval(b: thin_dielectric, wo: upper, wi: direction) within GRAZING;
    dielectric::thin_dielectric_sample(b: thin_dielectric, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    dielectric::rough_dielectric_albedo_sample(cos_theta: cosine, alpha: alpha, eta: eta, u: unit2) within GRAZING;
    // surface/anisotropic.rs
    anisotropic::anisotropic_widths(roughness: share, strength: share) within ROUNDING;
    anisotropic::anisotropic_d(h: upper, widths: widths) within ROUNDING;
    anisotropic::stretched_length(w: upper, widths: widths) within ROUNDING;
    anisotropic::anisotropic_g1_over_2cos(w: upper, widths: widths) within ROUNDING;
    anisotropic::anisotropic_sample_reflection_half(wo: upper, widths: widths, u: unit2) within GRAZING;
    anisotropic::anisotropic_sample_visible_half(wo: upper, widths: widths, u: unit2) within GRAZING;
    anisotropic::anisotropic_cap_half(wo_std: upper, widths: widths, lower: signed_cosine, u: unit2) within GRAZING;
    anisotropic::anisotropic_reflection_pdf(wo: upper, h: upper, widths: widths) within ROUNDING;
    anisotropic::anisotropic_visible_half_pdf(wo: upper, h: upper, widths: widths) within ROUNDING;
    // surface/sheen.rs
    sheen::sheen_alpha(roughness: share) within ROUNDING;
    sheen::charlie_d(cos_half: cosine, alpha: sheen_width) within FIBRES;
    sheen::charlie_curve(x: share, alpha: sheen_width) within POWERS;
    sheen::charlie_lambda(cos_theta: cosine, alpha: sheen_width) within FIBRES;
    sheen::sheen_lobe(wo: upper, wi: upper, alpha: sheen_width) within FIBRES;
    sheen::sample_sheen(u: unit2) within ROUNDING;
    sheen::pdf_sheen() within EXACT;
    sheen::sheen_albedo_coordinates(cos_theta: cosine, roughness: share) within ROUNDING;
    sheen::sheen_albedo_sample(cos_theta: cosine, roughness: share, u: unit2) within FIBRES;
    // surface/iridescence.rs
    iridescence::interference_color(path_difference: path_difference, shift: phases) within INTERFERENCE;
    iridescence::schlick(f0: share, cos_theta: cosine) within ROUNDING;
    iridescence::base_reflectance_in_film(f0: share, film_ior: ior) within CANCELLING;
    iridescence::base_phase(f0: share, film_ior: ior) within CANCELLING;
    iridescence::iridescent_fresnel(cos_theta: cosine, film_ior: ior, thickness: film_thickness, f0: albedo) within INTERFERENCE;
    iridescence::schlick_to_f0(reflectance: share, cos_theta: cosine) within GRAZING;
    // surface/oren_nayar.rs
    oren_nayar::fon_albedo(cos_theta: cosine, roughness: share) within ROUNDING;
    oren_nayar::fon_lost(cos_theta: cosine, roughness: share) within ROUNDING;
    oren_nayar::fon_mean_albedo(roughness: share) within ROUNDING;
    oren_nayar::eon_multiple_albedo(color: albedo, roughness: share) within ROUNDING;
    oren_nayar::eon_albedo(color: albedo, roughness: share, cos_o: cosine) within ROUNDING;
    oren_nayar::rough_diffuse(color: albedo, roughness: share, cos_o: cosine) within CANCELLING;
    oren_nayar::scaled_rough_diffuse(d: rough_diffuse, share: share) within ROUNDING;
    oren_nayar::rough_diffuse_factor(d: rough_diffuse, wo: upper, wi: upper) within GRAZING;
    oren_nayar::sample_rough_diffuse(roughness: share, u: unit2) within GRAZING;
    oren_nayar::pdf_rough_diffuse(roughness: share, cos_i: cosine) within ROUNDING;
    // surface/layered.rs
    layered::lost_share(albedo: ggx_albedo, single_scatter: flag) within ROUNDING;
    layered::interface_compensation(albedo: share, eta: eta) within CANCELLING;
    layered::interface_albedo(e: layer_albedos, eta: eta, f0: share, f90: share) within GRAZING;
    layered::dielectric_f0(m: layers, cos_theta: cosine) within INTERFERENCE;
    layered::film_f0(m: layers, f0: albedo, cos_theta: cosine) within INTERFERENCE;
    layered::layered_bsdf(m: layers, e: layer_albedos, wo: upper, refraction_tint: albedo, single_scatter: flag) within INTERFERENCE;
    layered::layered_color(m: layers, sheen_albedo: share) within ROUNDING;
    layered::no_layers() within EXACT;
    layered::refraction_schlick(cos_theta: cosine, eta: eta) within GRAZING;
    layered::anisotropy_axis(f: frame, rotation: point2, texel: share2) within CANCELLING;
    layered::choose_dispersed(dispersion: size, ior: ior, throughput: albedo, u: unit) within GRAZING;
    // surface/lobes.rs
    lobes::layered_transmits(b: layered) within EXACT;
    lobes::layered_reflected_share(b: layered) within ROUNDING;
    lobes::layered_reflects(b: layered) within EXACT;
    lobes::layered_is_sharp(b: layered) within EXACT;
    lobes::layered_without_diffuse(b: layered) within ROUNDING;
    lobes::layered_eval(b: layered, wo: upper, wi: direction) within GRAZING;
    lobes::lobes_above(b: layered, wo: upper, wi: upper) within GRAZING;
    lobes::anisotropic_lobe(wo: upper, wi: upper, h: upper, widths: widths) within ROUNDING;
    lobes::coat_lobe(b: layered, wo: upper, wi: upper, h: upper) within GRAZING;
    lobes::lobes_below(b: layered, wo: upper, wi: lower) within GRAZING;
    lobes::passing_share(b: layered, cos_theta: cosine) within GRAZING;
    lobes::refracted_lobe(b: layered, wo: upper, wi: lower) within GRAZING;
    lobes::layered_sample(b: layered, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    lobes::sample_lobe(b: layered, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    lobes::sample_refracted(b: layered, wo: upper, u: unit2) within GRAZING;
    // surface/bsdf.rs
    bsdf::bsdf_sample(b: bsdf, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    bsdf::bsdf_eval(b: bsdf, wo: upper, wi: direction) within GRAZING;
    bsdf::bsdf_has_smooth_part(b: bsdf) within EXACT;
    bsdf::bsdf_has_lobes(b: bsdf) within EXACT;
    bsdf::bsdf_transmits(b: bsdf) within EXACT;
    bsdf::bsdf_is_delta(b: bsdf) within EXACT;
    bsdf::bsdf_is_sharp(b: bsdf) within EXACT;
    bsdf::bsdf_scatters(b: bsdf) within EXACT;
    bsdf::bsdf_diffuse_albedo(b: bsdf) within ROUNDING;
    bsdf::bsdf_lobe_colors(b: bsdf) within ROUNDING;
    bsdf::bsdf_without_diffuse(b: bsdf) within EXACT;
    bsdf::bsdf_reflects(b: bsdf) within EXACT;
    bsdf::bsdf_is_interface(b: bsdf) within EXACT;
    bsdf::bsdf_reflected_share(b: bsdf, cos_o: cosine) within ROUNDING;
    bsdf::bsdf_phong_eval(b: bsdf, wo: upper, wi: direction) within GRAZING;
    // surface/closure.rs
    closure::plain_closure(b: bsdf, normal: direction) within CANCELLING;
    closure::layered_closure(b: layered, frame: frame) within EXACT;
    closure::closure_scatters(c: closure) within EXACT;
    closure::closure_has_smooth_part(c: closure) within EXACT;
    closure::closure_has_lobes(c: closure) within EXACT;
    closure::closure_is_delta(c: closure) within EXACT;
    closure::closure_is_sharp(c: closure) within EXACT;
    closure::closure_transmits(c: closure) within EXACT;
    closure::closure_eta(c: closure) within EXACT;
    closure::closure_eval(c: closure, wo: upper, wi: direction) within GRAZING;
    closure::closure_sample(c: closure, wo: upper, u_lobe: unit, u: unit2) within GRAZING;
    closure::closure_diffuse_albedo(c: closure) within ROUNDING;
    closure::closure_diffuse_albedo_below(c: closure) within EXACT;
    closure::closure_lobe_colors(c: closure) within ROUNDING;
    closure::closure_without_diffuse(c: closure) within ROUNDING;
    closure::closure_reflects(c: closure) within EXACT;
    closure::closure_is_interface(c: closure) within EXACT;
    closure::closure_reflected_share(c: closure, cos_o: cosine) within ROUNDING;
    closure::closure_phong_eval(c: closure, wo: upper, wi: direction) within GRAZING;
    // surface/pattern.rs
    pattern::square_wave_integral(x: real) within ROUNDING;
    pattern::checkerboard(p: point2, width: share) within ROUNDING;
    pattern::footprint_width(radius: share, cos_theta: cosine) within ROUNDING;
    pattern::distance_fade(distance: positive, near: size, far: size) within ROUNDING;
    // materials/image_texture.rs
    image_texture::no_texture() within EXACT;
    image_texture::wrap_texel(i: texel_index, size: count, mode: axis) within EXACT;
    image_texture::texel_column(t: texture_use, x: texel_index) within EXACT;
    image_texture::texel_row(t: texture_use, y: texel_index) within EXACT;
    image_texture::texel_place(t: placed_texture, column: count, row: count) within EXACT;
    image_texture::half_texel(rg: half_bytes, ba: half_bytes) within EXACT;
    image_texture::decode_texel(t: texture_use, stored: texel4) within POWERS;
    image_texture::decode_bytes(t: texture_use, stored: texel4) within POWERS;
    image_texture::texel_footprint(t: texture_use, coords: coordinates) within TEXELS;
    image_texture::mix_texels(f: texel_footprint, t00: texel4, t10: texel4, t01: texel4, t11: texel4) within ROUNDING;
    // materials/material.rs
    material::material_base_color(m: material_record, vertex_color: texel4, texel: texel4, pattern_position: point2, footprint_width: share) within CANCELLING;
    material::material_coverage(m: material_record, vertex_alpha: share, texel_alpha: share, pattern_position: point2) within STEPS;
    material::material_reads_alpha(m: material_record) within EXACT;
    material::material_has_holes(m: material_record) within EXACT;
    material::material_shines(m: material_record) within EXACT;
    material::material_emits(m: material_record, front: flag) within EXACT;
    material::material_emission(m: material_record, texel: texel4) within ROUNDING;
    material::material_eta(m: material_record, ior: ior, front: flag) within ROUNDING;
    // materials/plain.rs
    plain::material_may_refract(m: material_record) within EXACT;
    plain::material_mixes_models(m: material_record) within EXACT;
    plain::plain_point(m: material_record, base_color: albedo, metallic_roughness: texel4, transmission: texel4, ior: ior, front: flag, u_model: unit, single_scatter: flag) within GRAZING;
    plain::plain_bsdf(p: plain_point, albedo: ggx_albedo, single_scatter: flag) within ROUNDING;
    // materials/layers.rs
    layers::coat_normal(l: layers_record, s: surface_directions, texel: texel4) within GRAZING;
    layers::anisotropy_frame(l: layers_record, s: surface_directions, texel: texel4) within GRAZING;
    layers::layered_point(m: material_record, l: layers_record, s: surface_directions, base_color: albedo, t: layer_texels, ior: ior, front: flag, throughput: albedo, u_dispersion: unit) within GRAZING;
    layers::has_coat(m: layers) within EXACT;
    layers::has_sheen(m: layers) within EXACT;
    layers::has_interface(m: layers) within EXACT;
    layers::coat_cosine(p: layered_point) within CANCELLING;
    layers::no_albedos() within EXACT;
}
