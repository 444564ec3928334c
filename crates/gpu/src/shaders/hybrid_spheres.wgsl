// Where the camera sees a sphere that the rasteriser draws as the cube around it.

#import material, primitive, scene, scene_records
#import optics::camera, optics::constants

/// Where a camera ray meets sphere `in_geometry` of an instance's geometry first and it is there; zero if it does not.
fn seen_sphere(instance: u32, geometry: u32, binding: Binding, in_geometry: u32, ray: CameraRay) -> f32 {
    var origin = ray.origin;
    var direction = ray.direction;
    if (instances[instance].flags & INSTANCE_IDENTITY) == 0u {
        origin = transform_point(instances[instance].world_to_object, origin);
        direction = transform_vector(instances[instance].world_to_object, direction);
    }
    let primitive = binding.first_in_blas + in_geometry;
    return sphere_crossing(instance, geometry, primitive, sphere_at(binding, in_geometry), origin, direction, 0.0, FAR);
}
