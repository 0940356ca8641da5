//! Times of named scopes, as a tree.

use std::fmt;

use crate::error::readable::readable_name;

/// GPU times of the labelled parts of a frame or a submission.
///
/// See [`Context::set_profiling`](crate::Context::set_profiling). Its `Display` output is an indented list.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GpuProfile {
    /// [`Frame::number`](crate::Frame::number) of the frame; `None` for a submission outside of frames.
    pub frame: Option<u64>,
    /// Milliseconds from the first command to the end of the last, including commands outside of labels.
    pub ms: f64,
    /// The outermost labels, in the order of the GPU.
    pub scopes: Vec<GpuScope>,
}

/// GPU time between a [`push_label`](crate::CommandBuffer::push_label) and its
/// [`pop_label`](crate::CommandBuffer::pop_label), or of a named render pass.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GpuScope {
    /// The label.
    pub name: String,
    /// Milliseconds from the first command of the profile until all commands before the scope were done.
    pub start_ms: f64,
    /// Milliseconds from then until all commands of the scope were done.
    pub ms: f64,
    /// Labels inside of the scope, in the order of the GPU.
    pub children: Vec<Self>,
}

impl fmt::Display for GpuProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.frame {
            Some(number) => writeln!(f, "{:10.3} ms  frame {number}", self.ms)?,
            None => writeln!(f, "{:10.3} ms  submission", self.ms)?,
        }
        self.scopes.iter().try_for_each(|scope| scope.print(f, 1))
    }
}

impl GpuProfile {
    /// Moves the begin of the profile `ms` milliseconds earlier.
    pub(super) fn delay(&mut self, ms: f64) {
        self.ms += ms;
        self.scopes.iter_mut().for_each(|scope| scope.delay(ms));
    }
}

impl GpuScope {
    fn delay(&mut self, ms: f64) {
        self.start_ms += ms;
        self.children.iter_mut().for_each(|child| child.delay(ms));
    }

    fn print(&self, f: &mut fmt::Formatter<'_>, depth: usize) -> fmt::Result {
        writeln!(f, "{:10.3} ms  {:indent$}{}", self.ms, "", readable_name(&self.name), indent = 2 * depth)?;
        self.children.iter().try_for_each(|child| child.print(f, depth + 1))
    }
}

/// Timestamps of a command buffer in order: `Some` name for a begin, `None` for an end.
pub(crate) type Stamps = Vec<Option<Box<str>>>;

/// Returns the scopes of one command buffer. Its own begin and end are the outermost timestamps.
///
/// `ms` holds the time of each timestamp since the begin of the profile. Returns `None` if begins and ends are not
/// balanced.
pub(crate) fn scope_tree(stamps: &[Option<Box<str>>], ms: &[f64]) -> Option<GpuScope> {
    let mut open: Vec<GpuScope> = Vec::new();
    for (stamp, &time) in stamps.iter().zip(ms) {
        match stamp {
            Some(name) => {
                open.push(GpuScope { name: name.to_string(), start_ms: time, ..Default::default() });
            }
            None => {
                let mut scope = open.pop()?;
                scope.ms = time - scope.start_ms;
                match open.last_mut() {
                    Some(parent) => parent.children.push(scope),
                    None => return Some(scope),
                }
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn stamps(text: &str) -> Stamps {
        text.split_whitespace().map(|word| (word != ")").then(|| word.into())).collect()
    }

    fn nesting(scope: &GpuScope) -> String {
        let children: String = scope.children.iter().map(nesting).collect();
        format!("{} {children}) ", scope.name)
    }

    #[test]
    fn the_tree_is_the_nesting_with_its_times() {
        let ms = [0.0, 1.0, 1.5, 3.0, 4.0, 4.0, 8.0, 9.0];
        let root = scope_tree(&stamps("root a b ) ) c ) )"), &ms).unwrap();
        let times: Vec<_> = root.children.iter().map(|scope| (scope.start_ms, scope.ms)).collect();
        assert_eq!((root.ms, times), (9.0, vec![(1.0, 3.0), (4.0, 4.0)]));
        assert_eq!(root.children[0].children[0].ms, 1.5);
        let profile = GpuProfile { frame: Some(3), ms: root.ms, scopes: root.children };
        let text = "     9.000 ms  frame 3\n     3.000 ms    a\n     1.500 ms      b\n     4.000 ms    c\n";
        assert_eq!(profile.to_string(), text);
    }

    #[test]
    fn a_profile_that_begins_earlier_has_all_its_scopes_later() {
        let scopes = scope_tree(&stamps("root a b ) ) )"), &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]).unwrap().children;
        let mut profile = GpuProfile { frame: None, ms: 5.0, scopes };
        profile.delay(2.5);
        let outer = &profile.scopes[0];
        assert_eq!((profile.ms, outer.start_ms, outer.ms), (7.5, 3.5, 3.0));
        assert_eq!((outer.children[0].start_ms, outer.children[0].ms), (4.5, 1.0));
    }

    #[test]
    fn unbalanced_scopes_are_no_tree() {
        for text in ["", "root", "root a )", ")"] {
            assert_eq!(scope_tree(&stamps(text), &[0.0; 3]), None, "{text}");
        }
        assert_eq!(scope_tree(&stamps("root a ) )"), &[0.0; 3]), None);
    }

    proptest! {
        #[test]
        fn every_nesting_comes_back_and_children_lie_in_their_parents(steps in prop::collection::vec(any::<bool>(), 0..60)) {
            let (mut text, mut depth) = ("root ".to_owned(), 0);
            for (number, deeper) in steps.into_iter().enumerate() {
                if deeper {
                    text += &format!("s{number} ");
                    depth += 1;
                } else if depth > 0 {
                    text += ") ";
                    depth -= 1;
                }
            }
            text += &") ".repeat(depth + 1);
            let stamps = stamps(&text);
            let ms: Vec<f64> = (0..stamps.len()).map(|place| place as f64 * 0.5).collect();
            let root = scope_tree(&stamps, &ms).unwrap();
            prop_assert_eq!(nesting(&root), text);
            prop_assert!(nested(&root));
        }
    }

    fn nested(scope: &GpuScope) -> bool {
        let inside = |child: &GpuScope| {
            child.start_ms >= scope.start_ms && child.start_ms + child.ms <= scope.start_ms + scope.ms
        };
        scope.children.iter().all(|child| inside(child) && nested(child))
    }
}
