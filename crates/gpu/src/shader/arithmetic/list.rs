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
        "to be moved",
        &[
            (
                "direct",
                &[
                    "ambient_light",
                    "ambient_side",
                    "chain_radiance",
                    "follow",
                    "light_with_shadows",
                    "scatter",
                    "shadow_ray",
                ],
            ),
            ("light_chooser_list", &["choose_by_importance"]),
            ("light_chooser_pair", &["choose_by_importance", "light_key", "probability_by_importance"]),
            ("light_chooser_tree", &["choose_by_importance", "probability_by_importance"]),
            (
                "lights",
                &[
                    "chosen_probability",
                    "environment_image_pdf",
                    "environment_radiance",
                    "light_texture_point",
                    "path_add_distant_chosen",
                    "sample_environment_image",
                    "sample_light",
                    "sample_one_light",
                    "sample_portals",
                    "surface_light_pdf",
                    "textured_emission",
                ],
            ),
            (
                "material",
                &[
                    "alpha_accepts",
                    "base_color",
                    "is_culled",
                    "sphere_accepts",
                    "sphere_crossing",
                    "surface_bsdf",
                ],
            ),
            ("path_vertex", &["start_path", "travel"]),
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
            ("scattering_layered", &["layer_albedos", "lookup_sheen_albedo", "surface_layered_point"]),
            (
                "surface",
                &[
                    "mapped_normal",
                    "sphere_point",
                    "surface_at",
                    "tangent_frame",
                    "transformed_extent",
                    "triangle_point",
                ],
            ),
            (
                "texture",
                &["dielectric_albedo_plane", "lookup_dielectric_albedo", "lookup_ggx_albedo", "table_place"],
            ),
            (
                "texture_points",
                &["bumped_normal", "moved_texture_point", "sphere_texture_point", "triangle_texture_point"],
            ),
            ("volume_media", &["grid_density", "majorant_of", "ratio_track", "relative_ior", "within_grid"]),
            (
                "volume_vertex",
                &[
                    "advance",
                    "follow_way",
                    "pass_through",
                    "prepare_surface",
                    "track",
                    "way_from_medium",
                    "way_from_surface",
                ],
            ),
        ],
    ),
];
