//! Cameras and animations of a model by number or name, and lists of them.

use lvk_gltf::Model;

use crate::model::ModelCamera;

/// Errors of names that the arguments give.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ArgumentError {
    /// The model has no such animation.
    #[error("--animation {wish}: the model has {known}")]
    NoAnimation {
        /// As given.
        wish: String,
        /// Numbers and names.
        known: String,
    },
    /// The model has no such camera.
    #[error("--camera {wish}: the model has the cameras {known}")]
    NoCamera {
        /// As given.
        wish: String,
        /// Numbers and names.
        known: String,
    },
}

/// The animation that the arguments name.
pub(crate) fn animation_place(model: &Model, wish: &str) -> Result<usize, ArgumentError> {
    let number = wish.parse::<usize>().ok().filter(|number| (1..=model.animations.len()).contains(number));
    let named = || model.animations.iter().position(|animation| animation.name.as_deref() == Some(wish));
    number.map(|number| number - 1).or_else(named).ok_or_else(|| {
        let known = animation_lines(model);
        let known = if known.is_empty() { "no animation".to_owned() } else { known.join(", ") };
        ArgumentError::NoAnimation { wish: lvk::readable_name(wish), known }
    })
}

/// The animations, a line each.
pub(crate) fn animation_lines(model: &Model) -> Vec<String> {
    let name =
        |animation: &lvk_gltf::Animation| animation.name.clone().unwrap_or_else(|| "animation".to_owned());
    (1..)
        .zip(&model.animations)
        .map(|(number, animation)| format!("{number}  {}", lvk::readable_name(name(animation))))
        .collect()
}

/// The cameras, a line each.
pub(crate) fn numbered(cameras: &[ModelCamera]) -> Vec<String> {
    let line =
        |(number, camera): (usize, &ModelCamera)| format!("{number}  {}", lvk::readable_name(&camera.name));
    (1..).zip(cameras).map(line).collect()
}

pub(crate) fn camera_place(cameras: &[ModelCamera], wish: &str) -> Result<usize, ArgumentError> {
    let number = wish.parse::<usize>().ok().filter(|number| (1..=cameras.len()).contains(number));
    let place = number.map(|number| number - 1);
    let place = place.or_else(|| cameras.iter().position(|camera| camera.name == wish));
    place.ok_or_else(|| ArgumentError::NoCamera {
        wish: lvk::readable_name(wish),
        known: numbered(cameras).join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{cameras, showcase};

    #[test]
    fn cameras_are_chosen_by_number_or_name() {
        let model = showcase();
        let all = cameras(&model, 0, &model.pose(None, 0.0));
        assert_eq!(camera_place(&all, "1").unwrap(), 0);
        assert_eq!(camera_place(&all, "overview").unwrap(), all.len() - 1);
        let error = camera_place(&all, "9").unwrap_err().to_string();
        assert_eq!(error, "--camera 9: the model has the cameras 1  showcase, 2  overview");
    }
}
