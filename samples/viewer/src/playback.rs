//! Which animation plays, and where it stands.

use lvk_gltf::{Model, Pose};

/// An animation that plays, over and over.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Playback {
    /// The animation; none for the pose that the nodes have.
    pub(crate) animation: Option<usize>,
    /// Where it stands in the first frame, in seconds.
    pub(crate) start: f32,
    /// Seconds since the first frame.
    pub(crate) elapsed: f64,
}

impl Playback {
    /// The time that is shown, in seconds. After its end an animation begins anew.
    pub(crate) fn seconds(&self, model: &Model) -> f32 {
        let animation = self.animation.and_then(|animation| model.animations.get(animation));
        let duration = animation.map_or(0.0, lvk_gltf::Animation::duration);
        let seconds = f64::from(self.start) + self.elapsed;
        let is_over = seconds > f64::from(duration) && duration > 0.0;
        if is_over { seconds.rem_euclid(f64::from(duration)) as f32 } else { seconds as f32 }
    }

    /// The pose that is shown.
    pub(crate) fn pose(&self, model: &Model) -> Pose {
        model.pose(self.animation, self.seconds(model))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lvk_gltf::{Animation, Interpolation, Keyframes};

    #[test]
    fn an_animation_shows_its_end_once_and_begins_anew() {
        let keyframes = Keyframes {
            interpolation: Interpolation::Linear,
            times: vec![0.0, 2.0],
            components: 3,
            values: vec![0.0; 6],
        };
        let animation = Animation { keyframes: vec![keyframes], ..Animation::default() };
        let model = Model { animations: vec![animation], ..Model::default() };
        let at = |start, elapsed| Playback { animation: Some(0), start, elapsed }.seconds(&model);
        assert_eq!((at(0.5, 1.0), at(0.5, 1.5), at(0.5, 2.0)), (1.5, 2.0, 0.5));
        assert_eq!(at(0.0, 9.25), 1.25);
        let none = Playback { animation: None, start: 0.0, elapsed: 3.0 };
        assert_eq!(none.pose(&model), model.pose(None, 0.0));
    }
}
