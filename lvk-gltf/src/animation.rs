//! Animations: values of nodes over time.

use glam::{Quat, Vec3};

use crate::Transform;

/// An animation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Animation {
    /// Name in the file.
    pub name: Option<String>,
    /// Channels. No two have the same node and path.
    pub channels: Vec<Channel>,
    /// Values over time, which channels share.
    pub keyframes: Vec<Keyframes>,
}

/// What an animation moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel {
    /// The node, as an index into [`Model::nodes`](crate::Model::nodes).
    pub node: usize,
    /// What of the node moves.
    pub path: ChannelPath,
    /// Its values, as an index into [`Animation::keyframes`].
    pub keyframes: usize,
}

/// What of a node an animation moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChannelPath {
    /// Translation: three numbers, metres.
    Translation,
    /// Rotation: a unit quaternion x, y, z, w. Interpolated on the sphere.
    Rotation,
    /// Scale: three numbers.
    Scale,
    /// Weights of morph targets: as many numbers as the mesh has targets.
    Weights,
}

/// Values over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyframes {
    /// How values between two keyframes follow.
    pub interpolation: Interpolation,
    /// Times, seconds, 0 or more, in rising order. At least one.
    pub times: Vec<f32>,
    /// Numbers of a value: 3, 4 or the number of weights.
    pub components: usize,
    /// Values, one after the other. With [`Interpolation::CubicSpline`] each keyframe has three: the tangent towards it,
    /// the value, and the tangent away from it.
    pub values: Vec<f32>,
}

/// How values between two keyframes follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// The earlier value.
    Step,
    /// Linear; rotations on the sphere.
    Linear,
    /// A cubic Hermite spline.
    CubicSpline,
}

impl Animation {
    /// Returns the time of the last keyframe, seconds.
    #[must_use]
    pub fn duration(&self) -> f32 {
        self.keyframes
            .iter()
            .filter_map(|keyframes| keyframes.times.last())
            .fold(0.0, |most, time| most.max(*time))
    }
}

impl Keyframes {
    /// Returns the value at a time, seconds: before the first keyframe the first value, after the last one the last value.
    #[must_use]
    pub fn sample(&self, seconds: f32, path: ChannelPath) -> Vec<f32> {
        let count = self.times.len();
        let after = self.times.partition_point(|time| *time <= seconds);
        let value = match (after, self.interpolation) {
            (0, _) => self.value(0).to_vec(),
            (after, _) if after >= count => self.value(count.saturating_sub(1)).to_vec(),
            (after, Interpolation::Step) => self.value(after - 1).to_vec(),
            (after, Interpolation::Linear) => self.linear(after - 1, seconds, path),
            (after, Interpolation::CubicSpline) => self.cubic(after - 1, seconds),
        };
        if path == ChannelPath::Rotation { normalized(value) } else { value }
    }

    /// Returns the value of a keyframe.
    fn value(&self, keyframe: usize) -> &[f32] {
        match self.interpolation {
            Interpolation::CubicSpline => self.part(3 * keyframe + 1),
            Interpolation::Step | Interpolation::Linear => self.part(keyframe),
        }
    }

    fn part(&self, index: usize) -> &[f32] {
        let start = index * self.components;
        self.values.get(start..start + self.components).unwrap_or_default()
    }

    /// Returns the distance to the next keyframe, seconds, and the part of it that has passed.
    fn phase(&self, keyframe: usize, seconds: f32) -> (f32, f32) {
        let (start, end) = (self.times[keyframe], self.times[keyframe + 1]);
        let length = end - start;
        (length, if length > 0.0 { (seconds - start) / length } else { 0.0 })
    }

    fn linear(&self, keyframe: usize, seconds: f32, path: ChannelPath) -> Vec<f32> {
        let (_, phase) = self.phase(keyframe, seconds);
        let (from, to) = (self.value(keyframe), self.value(keyframe + 1));
        if path == ChannelPath::Rotation {
            return quaternion(from).slerp(quaternion(to), phase).to_array().to_vec();
        }
        from.iter().zip(to).map(|(from, to)| from + phase * (to - from)).collect()
    }

    /// The spline of the specification's appendix C: tangents are a second's change, so the interval's length multiplies them.
    fn cubic(&self, keyframe: usize, seconds: f32) -> Vec<f32> {
        let (length, t) = self.phase(keyframe, seconds);
        let (t2, t3) = (t * t, t * t * t);
        let scales = [
            2.0 * t3 - 3.0 * t2 + 1.0,
            length * (t3 - 2.0 * t2 + t),
            -2.0 * t3 + 3.0 * t2,
            length * (t3 - t2),
        ];
        let parts = [1, 2, 4, 3].map(|part| self.part(3 * keyframe + part));
        let sum = |i| {
            scales.iter().zip(parts).map(|(scale, part)| scale * part.get(i).copied().unwrap_or(0.0)).sum()
        };
        (0..self.components).map(sum).collect()
    }
}

impl Animation {
    /// Sets what the channels move to its value at a time.
    pub(crate) fn apply(&self, seconds: f32, transforms: &mut [Transform], weights: &mut [Vec<f32>]) {
        for channel in &self.channels {
            let Some(keyframes) = self.keyframes.get(channel.keyframes) else { continue };
            let value = keyframes.sample(seconds, channel.path);
            if channel.path == ChannelPath::Weights {
                weights.get_mut(channel.node).into_iter().for_each(|weights| weights.clone_from(&value));
            } else if let (Some(Transform::Trs(trs)), [x, y, z, ..]) =
                (transforms.get_mut(channel.node), &value[..])
            {
                match channel.path {
                    ChannelPath::Translation => trs.translation = Vec3::new(*x, *y, *z),
                    ChannelPath::Scale => trs.scale = Vec3::new(*x, *y, *z),
                    _ => trs.rotation = quaternion(&value),
                }
            }
        }
    }
}

fn quaternion(value: &[f32]) -> Quat {
    if let [x, y, z, w] = value { Quat::from_xyzw(*x, *y, *z, *w) } else { Quat::IDENTITY }
}

fn normalized(value: Vec<f32>) -> Vec<f32> {
    let quaternion = quaternion(&value);
    let unit = if quaternion.length_squared() > 0.0 { quaternion.normalize() } else { Quat::IDENTITY };
    unit.to_array().to_vec()
}
