//! What [`super`] allows.

/// A reason, and the files of `shaders/` with their functions that it is the reason of.
type Reason = (&'static str, &'static [(&'static str, &'static [&'static str])]);

/// Why functions compute in WGSL, and which do.
///
/// A formula of light transport has no reason to be here.
pub(super) const LISTED: &[Reason] = &[
    ("a product with a matrix, which the optics have no type for", &[("projection", &["clip_from"])]),
    ("which pixel of a film lies at a place of a window", &[("screen", &["film_pixel"])]),
    (
        "walks of the hierarchy: boxes as they are packed, made larger by what rounding may lose; no light is computed",
        &[
            ("bvh_entries", &["bvh_hits_box"]),
            ("bvh_nodes", &["bvh_crossings", "bvh_hit_children", "bvh_is_valid", "bvh_ray"]),
            ("tracer_bvh", &["bvh_walk"]),
            ("tracer_bvh_packets", &["bvh_beam", "bvh_beam_hits", "trace_closest_packet"]),
        ],
    ),
    (
        "makes the upper levels of the hierarchy from boxes of instances; no light is computed",
        &[(
            "bvh_upper",
            &[
                "enter",
                "find_keys",
                "finish_world",
                "grid_of",
                "inverse_rows",
                "is_usable",
                "make_nodes",
                "place",
                "step_above",
                "step_below",
                "transformed_axis",
            ],
        )],
    ),
    (
        "bounds of a ray as the device's own tracer wants them",
        &[
            ("tracer_pipeline", &["ray_is_traceable", "trace_any", "trace_either"]),
            ("tracer_query", &["trace_either"]),
        ],
    ),
    (
        "what a fetch returns: attributes between the corners of a primitive, points and normals in another space",
        &[
            ("lights", &["light_texture_point"]),
            ("material", &["alpha_accepts", "is_culled", "sphere_accepts", "sphere_crossing"]),
            (
                "primitive",
                &[
                    "object_position",
                    "transform_normal",
                    "transform_point",
                    "transform_vector",
                    "triangle_coords",
                    "triangle_words4",
                ],
            ),
            (
                "surface",
                &["mapped_normal", "sphere_point", "surface_at", "transformed_extent", "triangle_point"],
            ),
            (
                "texture_points",
                &["bumped_normal", "moved_texture_point", "sphere_texture_point", "triangle_texture_point"],
            ),
        ],
    ),
    (
        "what a fetch returns: tables between their entries",
        &[
            ("scattering_layered", &["lookup_sheen_albedo"]),
            (
                "texture",
                &["dielectric_albedo_plane", "lookup_dielectric_albedo", "lookup_ggx_albedo", "table_place"],
            ),
        ],
    ),
    (
        "a cosine, which side, or the inverse of a direction, for a function of the optics",
        &[
            ("direct", &["scatter", "shadow_ray"]),
            ("material", &["base_color", "surface_bsdf"]),
            ("scattering_layered", &["layer_albedos", "surface_layered_point"]),
            ("volume_media", &["majorant_of", "within_grid"]),
            ("volume_vertex", &["prepare_surface", "way_from_surface"]),
        ],
    ),
    (
        "a product of two results of the optics: throughput and radiance, a density and the probability of its choice",
        &[
            ("direct", &["ambient_light", "chain_radiance", "follow", "light_with_shadows"]),
            (
                "lights",
                &[
                    "chosen_probability",
                    "path_add_distant_chosen",
                    "sample_light",
                    "sample_one_light",
                    "surface_light_pdf",
                    "textured_emission",
                ],
            ),
            ("path_vertex", &["start_path", "travel"]),
            ("volume_vertex", &["advance", "follow_way", "pass_through", "track", "way_from_medium"]),
        ],
    ),
    (
        "a loop over records whose steps are the optics', with a product in between",
        &[
            ("direct", &["ambient_side"]),
            ("kernel_ao", &["open_share"]),
            ("light_chooser_list", &["choose_by_importance"]),
            ("light_chooser_pair", &["choose_by_importance", "light_key", "probability_by_importance"]),
            ("light_chooser_tree", &["choose_by_importance", "probability_by_importance"]),
            ("lights", &["sample_portals"]),
            ("volume_media", &["ratio_track"]),
        ],
    ),
    (
        "the learned denoiser's network and the filter that it steers, as `post` has them on the CPU, which tests compare them with",
        &[
            ("denoise_features", &["compressed_irradiance"]),
            ("denoise_inputs", &["input_quad"]),
            ("denoise_kernels", &["add_products", "filter_pixel", "largest_logit"]),
            ("denoise_lanes", &["convolve"]),
            ("denoise_levels", &["between", "combined_pixel"]),
            ("denoise_math", &["denoise_mean", "denoise_sigmoid"]),
            ("denoise_outputs", &["write_quad"]),
            ("denoise_result", &["finish"]),
            ("denoise_trust", &["find_trust", "shares_of"]),
            ("realtime_learned", &["deviation_seen", "show_network"]),
            ("realtime_learned_result", &["finish_learned", "limited"]),
        ],
    ),
];
