//! The mip levels that shaders have wanted of late.

/// Reports after which what was wanted before the last so many is forgotten.
const PERIOD: u32 = 16;
/// Level of images that shaders have not read.
pub(super) const UNREAD: u32 = u32::MAX;

/// The finest level of each image that shaders wanted to read in the last 16 to 32 reports. Rays are random, so a report lacks levels
/// that the next one has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct WantedMips {
    now: Vec<u32>,
    before: Vec<u32>,
    report_count: u32,
}

impl WantedMips {
    pub(super) fn new(image_count: usize) -> Self {
        Self { now: vec![UNREAD; image_count], before: vec![UNREAD; image_count], report_count: 0 }
    }

    /// Adds a report: the finest level that was read of each image.
    pub(super) fn add(&mut self, report: &[u32]) {
        if self.report_count == PERIOD {
            self.report_count = 0;
            self.before = std::mem::replace(&mut self.now, vec![UNREAD; self.before.len()]);
        }
        self.report_count += 1;
        for (now, read) in self.now.iter_mut().zip(report) {
            *now = (*now).min(*read);
        }
    }

    /// The finest level of each image.
    pub(super) fn levels(&self) -> Vec<u32> {
        self.now.iter().zip(&self.before).map(|(now, before)| *now.min(before)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_no_longer_read_are_forgotten_after_one_to_two_periods() {
        let mut wanted = WantedMips::new(2);
        assert_eq!(wanted.levels(), [UNREAD; 2]);
        wanted.add(&[3, UNREAD]);
        wanted.add(&[5, 4]);
        assert_eq!(wanted.levels(), [3, 4]);
        let reports = (0..3 * PERIOD).map(|_| {
            wanted.add(&[6, 4]);
            wanted.levels()[0]
        });
        let kept = reports.take_while(|level| *level == 3).count() as u32;
        assert!((PERIOD..2 * PERIOD).contains(&kept), "{kept}");
        assert_eq!(wanted.levels(), [6, 4]);
    }
}
