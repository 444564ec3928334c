//! From transforms at keys to segments of a motion, which `optics::motion` interpolates.

use elementary::atan2;
use glam::{Affine3A, DMat3, DQuat, DVec3, Mat3, Vec3};
use optics::motion::{AffineRows, MotionSegment};
use optics::vec4f;

/// How far a motion of few segments may be from the transforms that it stands for, as a share of
/// the largest number in their matrices, and of the way that they go.
const TOLERANCE: f32 = 1e-5;

/// The most steps towards a rotation; each halves the error at least, and near the end squares it.
const MOST_STEPS: u32 = 64;

/// A transform as a translation, a rotation and a symmetric stretch: M = T R S.
struct Parts {
    translation: DVec3,
    rotation: DQuat,
    stretch: DMat3,
}

impl Parts {
    /// By polar decomposition. A matrix that mirrors has a stretch that does.
    ///
    /// Method: Shoemake and Duff 1992, after Higham 1986: the rotation is the limit of averages of
    /// a matrix and its inverse transpose.
    fn of(transform: &Affine3A) -> Self {
        let translation = Vec3::from(transform.translation).as_dvec3();
        let matrix = Mat3::from(transform.matrix3).as_dmat3();
        let mut q = matrix;
        for _ in 0..MOST_STEPS {
            let next = (q + q.inverse().transpose()) * 0.5;
            let change = (next - q).to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            q = next;
            if change < 1e-14 {
                break;
            }
        }
        if q.determinant() < 0.0 {
            q *= -1.0;
        }
        if !q.is_finite() {
            // Squeezed to a plane: nothing that can be hit.
            return Self { translation, rotation: DQuat::IDENTITY, stretch: matrix };
        }
        let stretch = q.transpose() * matrix;
        let stretch = (stretch + stretch.transpose()) * 0.5;
        Self { translation, rotation: DQuat::from_mat3(&q).normalize(), stretch }
    }
}

/// The segment between two transforms.
fn segment(from: &Parts, to: &Parts) -> MotionSegment {
    let (first, mut last) = (from.rotation, to.rotation);
    let mut cosine = first.dot(last);
    if cosine < 0.0 {
        (last, cosine) = (-last, -cosine);
    }
    // What is at right angles to the first rotation.
    let across = last - first * cosine;
    let sine = across.length();
    let (angle, step) = if sine > 1e-9 {
        (atan2(sine, cosine), across * sine.recip())
    } else {
        (0.0, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0))
    };
    let vector = |v: DVec3, w: f64| vec4f(v.x as f32, v.y as f32, v.z as f32, w as f32);
    let quaternion = |q: DQuat| vec4f(q.x as f32, q.y as f32, q.z as f32, q.w as f32);
    let diagonal = |m: &DMat3| DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z);
    let others = |m: &DMat3| DVec3::new(m.y_axis.x, m.z_axis.x, m.z_axis.y);
    let (s, t) = (&from.stretch, &to.stretch);
    MotionSegment {
        translation: vector(from.translation, angle),
        translation_step: vector(to.translation - from.translation, 0.0),
        rotation: quaternion(first),
        rotation_step: quaternion(step),
        stretch: vector(diagonal(s), 0.0),
        stretch_step: vector(diagonal(t) - diagonal(s), 0.0),
        shear: vector(others(s), 0.0),
        shear_step: vector(others(t) - others(s), 0.0),
    }
}

/// The segments of a motion through equally spaced `keys`, at least two.
pub fn motion_through(keys: &[Affine3A]) -> Vec<MotionSegment> {
    let parts: Vec<Parts> = keys.iter().map(Parts::of).collect();
    parts.windows(2).map(|pair| segment(&pair[0], &pair[1])).collect()
}

/// As [`motion_through`], of a transform that was looked at often: with the fewest segments, 1, 2,
/// 4, …, that pass all of `keys`, whose number is a power of two and one more. `None` if it stands
/// still.
pub fn motion_near(keys: &[Affine3A]) -> Option<Vec<MotionSegment>> {
    if keys.windows(2).all(|pair| pair[0] == pair[1]) {
        return None;
    }
    let count = keys.len() - 1;
    let fewest = (0..).map(|i| 1usize << i).take_while(|n| *n < count);
    for segments in fewest {
        let chosen: Vec<Affine3A> = keys.iter().step_by(count / segments).copied().collect();
        let motion = motion_through(&chosen);
        if keys.iter().enumerate().all(|(i, key)| is_near(&motion, i as f32 / count as f32, key, keys)) {
            return Some(motion);
        }
    }
    Some(motion_through(keys))
}

/// Whether a motion is at `key` at `time`.
fn is_near(motion: &[MotionSegment], time: f32, key: &Affine3A, all: &[Affine3A]) -> bool {
    let at = transform_of(&AffineRows::of_motion(motion, time));
    let size = key.matrix3.to_cols_array().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
    let way = all.iter().map(|k| (k.translation - all[0].translation).length()).fold(0.0, f32::max);
    let rounding = key.translation.abs().max_element();
    let linear = (at.matrix3 - key.matrix3).to_cols_array().iter().all(|x| x.abs() <= TOLERANCE * size);
    let translation = (at.translation - key.translation).abs().max_element();
    linear && translation <= TOLERANCE * way + 4.0 * f32::EPSILON * rounding
}

/// The transform with these rows.
pub fn transform_of(rows: &AffineRows) -> Affine3A {
    let [x, y, z] = rows.rows();
    let column = |i: usize| Vec3::new(x[i], y[i], z[i]);
    Affine3A::from_mat3_translation(Mat3::from_cols(column(0), column(1), column(2)), column(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn close(a: &Affine3A, b: &Affine3A) -> bool {
        a.abs_diff_eq(*b, 1e-5)
    }

    #[test]
    fn motions_pass_their_keys() {
        let shear = Mat3::from_cols(Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.0, 0.2, 2.0));
        let keys = [
            Affine3A::from_scale_rotation_translation(
                Vec3::new(1.0, 2.0, 3.0),
                Quat::from_rotation_y(1.0),
                Vec3::new(1.0, -2.0, 5.0),
            ),
            Affine3A::from_mat3_translation(shear, Vec3::Z),
            Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)) * Affine3A::from_rotation_x(2.5),
            Affine3A::from_scale(Vec3::splat(-0.5)),
            Affine3A::from_quat(Quat::from_rotation_z(3.1)),
        ];
        for (i, key) in keys.iter().enumerate() {
            let other = &keys[(i + 1) % keys.len()];
            let motion = motion_through(&[*key, *other]);
            let [start, end] = [0.0, 1.0].map(|time| transform_of(&AffineRows::of_motion(&motion, time)));
            assert!(close(&start, key) && close(&end, other), "{key:?} {other:?}: {start:?} {end:?}");
        }
    }

    #[test]
    fn few_segments_do_where_the_motion_is_simple() {
        let turn = |time: f32| Affine3A::from_rotation_y(2.0 * time) * Affine3A::from_scale(Vec3::splat(3.0));
        let samples =
            |of: &dyn Fn(f32) -> Affine3A| (0..=16).map(|i| of(i as f32 / 16.0)).collect::<Vec<_>>();
        let count = |of: &dyn Fn(f32) -> Affine3A| motion_near(&samples(of)).map(|motion| motion.len());
        assert_eq!(count(&|_| turn(1.0)), None);
        assert_eq!(count(&turn), Some(1));
        let bent = |time: f32| Affine3A::from_translation(Vec3::new(time, (time - 0.5).abs(), 0.0));
        assert_eq!(count(&bent), Some(2));
        let falling = |time: f32| Affine3A::from_translation(Vec3::new(0.0, -time * time, 0.0));
        assert_eq!(count(&falling), Some(16));
        // Several turns, which no single arc can be.
        assert_eq!(count(&|time| Affine3A::from_rotation_y(20.0 * time)), Some(8));
    }
}
