//! Values for each mip level and array layer of a texture. A single value is stored while they are all equal.

use super::resource_state::BarrierScopes;

/// Mip levels and array layers of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TextureShape {
    /// Mip levels, at least 1.
    pub(crate) mips: u32,
    /// Array layers, at least 1 (cube maps: 6 for each cube).
    pub(crate) layers: u32,
}

impl TextureShape {
    /// Returns the range of all mips and layers.
    #[inline]
    pub(crate) fn all_subresources(self) -> Subresources {
        Subresources { base_mip: 0, mip_count: self.mips, base_layer: 0, layer_count: self.layers }
    }

    #[inline]
    fn clamp(self, range: Subresources) -> Subresources {
        let base_mip = range.base_mip.min(self.mips);
        let base_layer = range.base_layer.min(self.layers);
        Subresources {
            base_mip,
            mip_count: range.mip_count.min(self.mips - base_mip),
            base_layer,
            layer_count: range.layer_count.min(self.layers - base_layer),
        }
    }
}

/// A range of mip levels of a range of array layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Subresources {
    /// First mip level.
    pub(crate) base_mip: u32,
    /// Number of mip levels.
    pub(crate) mip_count: u32,
    /// First array layer.
    pub(crate) base_layer: u32,
    /// Number of array layers.
    pub(crate) layer_count: u32,
}

impl Subresources {
    fn is_empty(self) -> bool {
        self.mip_count == 0 || self.layer_count == 0
    }

    /// Returns the common part of both ranges, if any.
    #[inline]
    pub(crate) fn intersection(self, other: Self) -> Option<Self> {
        let (base_mip, mip_count) =
            range_intersection((self.base_mip, self.mip_count), (other.base_mip, other.mip_count))?;
        let (base_layer, layer_count) =
            range_intersection((self.base_layer, self.layer_count), (other.base_layer, other.layer_count))?;
        Some(Self { base_mip, mip_count, base_layer, layer_count })
    }

    /// Returns the part of this range outside `cut`, as disjoint ranges.
    pub(crate) fn without(self, cut: Self) -> impl Iterator<Item = Self> {
        let pieces = match self.intersection(cut) {
            None => [self, EMPTY, EMPTY, EMPTY],
            Some(cut) => {
                let mips = |base_mip, mip_count| Self { base_mip, mip_count, ..self };
                let layers = |base_layer, layer_count| Self { base_layer, layer_count, ..cut };
                let (mip_end, layer_end) = (cut.base_mip + cut.mip_count, cut.base_layer + cut.layer_count);
                [
                    mips(self.base_mip, cut.base_mip - self.base_mip),
                    mips(mip_end, self.base_mip + self.mip_count - mip_end),
                    layers(self.base_layer, cut.base_layer - self.base_layer),
                    layers(layer_end, self.base_layer + self.layer_count - layer_end),
                ]
            }
        };
        pieces.into_iter().filter(|piece| !piece.is_empty())
    }

    /// Extends the range by `mip` if it is a single layer equal to `layer`, and `mip` is the next mip level.
    /// Returns true if extended.
    fn extend_mips(&mut self, mip: u32, layer: u32) -> bool {
        let follows = self.base_mip + self.mip_count == mip;
        let extends = follows && self.base_layer == layer && self.layer_count == 1;
        self.mip_count += u32::from(extends);
        extends
    }

    /// Extends the range by `next` if it has the same mips and starts at the next layer. Returns true if
    /// extended.
    fn extend_layers(&mut self, next: Self) -> bool {
        let same_mips = self.base_mip == next.base_mip && self.mip_count == next.mip_count;
        let extends = same_mips && self.base_layer + self.layer_count == next.base_layer;
        self.layer_count += if extends { next.layer_count } else { 0 };
        extends
    }
}

const EMPTY: Subresources = Subresources { base_mip: 0, mip_count: 0, base_layer: 0, layer_count: 0 };

/// Returns the intersection of two ranges, each given as start and count.
fn range_intersection((a, a_count): (u32, u32), (b, b_count): (u32, u32)) -> Option<(u32, u32)> {
    let (start, end) = (a.max(b), (a + a_count).min(b + b_count));
    (start < end).then(|| (start, end - start))
}

/// One `T` for each subresource.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PerSubresource<T> {
    shape: TextureShape,
    values: PerSubresourceValues<T>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum PerSubresourceValues<T> {
    /// One value for all subresources.
    Same(T),
    /// One value for each subresource, layer by layer. Not all are equal.
    Each(Vec<T>),
}

impl<T: Copy + PartialEq> PerSubresource<T> {
    /// Creates the same value for all subresources. Zero mips or layers count as one.
    pub(crate) fn new(shape: TextureShape, value: T) -> Self {
        let shape = TextureShape { mips: shape.mips.max(1), layers: shape.layers.max(1) };
        Self { shape, values: PerSubresourceValues::Same(value) }
    }

    /// Creates a value for each mip and layer.
    pub(crate) fn from_fn(shape: TextureShape, value: impl Fn(u32, u32) -> T) -> Self {
        let mut cells = Self::new(shape, value(0, 0));
        let each = positions(cells.shape.all_subresources()).map(|(mip, layer)| value(mip, layer)).collect();
        cells.values = PerSubresourceValues::from_each(each);
        cells
    }

    /// Returns the values mapped by `value`.
    pub(crate) fn map<U: Copy + PartialEq>(&self, value: impl Fn(&T) -> U) -> PerSubresource<U> {
        let values = match &self.values {
            PerSubresourceValues::Same(same) => PerSubresourceValues::Same(value(same)),
            PerSubresourceValues::Each(each) => {
                PerSubresourceValues::from_each(each.iter().map(value).collect())
            }
        };
        PerSubresource { shape: self.shape, values }
    }

    /// Returns ranges of equal values.
    pub(crate) fn uniform_ranges(&self) -> Vec<(Subresources, T)> {
        let mut runs = Vec::new();
        match self.uniform() {
            Some(value) => return vec![(self.shape.all_subresources(), *value)],
            None => positions(self.shape.all_subresources())
                .for_each(|(mip, layer)| push_single(&mut runs, mip, layer, *self.at(mip, layer))),
        }
        join_layers(runs)
    }

    /// Returns the number of mips and layers.
    pub(crate) fn shape(&self) -> TextureShape {
        self.shape
    }

    /// Returns the common value of all subresources. `None` if they differ.
    pub(crate) fn uniform(&self) -> Option<&T> {
        match &self.values {
            PerSubresourceValues::Same(value) => Some(value),
            PerSubresourceValues::Each(_) => None,
        }
    }

    /// Returns the value of one subresource. Positions outside the texture return the last one.
    pub(crate) fn at(&self, mip: u32, layer: u32) -> &T {
        match &self.values {
            PerSubresourceValues::Same(value) => value,
            PerSubresourceValues::Each(each) => &each[index(self.shape, mip, layer)],
        }
    }

    /// True if `test` is true for any subresource in `range`.
    pub(crate) fn any(&self, range: Subresources, mut test: impl FnMut(&T) -> bool) -> bool {
        let range = self.shape.clamp(range);
        match self.uniform() {
            Some(value) => !range.is_empty() && test(value),
            None => positions(range).any(|(mip, layer)| test(self.at(mip, layer))),
        }
    }

    /// Applies `step` to all subresources of `range` and returns the barriers. Equal barriers of neighbours
    /// are merged.
    pub(crate) fn update(
        &mut self,
        range: Subresources,
        mut step: impl FnMut(&mut T) -> Option<BarrierScopes>,
    ) -> Vec<(Subresources, BarrierScopes)> {
        let (whole, range) = (self.shape.all_subresources(), self.shape.clamp(range));
        match self.uniform_mut(range) {
            Some(value) => step(value).map(|scopes| (whole, scopes)).into_iter().collect(),
            None => self.update_each(range, |value, _, _| step(value)),
        }
    }

    /// Returns the common value of all subresources if `range` covers the whole texture.
    #[inline]
    pub(crate) fn uniform_mut(&mut self, range: Subresources) -> Option<&mut T> {
        match &mut self.values {
            PerSubresourceValues::Same(value) if range == self.shape.all_subresources() => Some(value),
            _ => None,
        }
    }

    /// As [`PerSubresource::update`], for a step that also depends on the mip and the layer.
    pub(crate) fn update_each(
        &mut self,
        range: Subresources,
        mut step: impl FnMut(&mut T, u32, u32) -> Option<BarrierScopes>,
    ) -> Vec<(Subresources, BarrierScopes)> {
        let (shape, range) = (self.shape, self.shape.clamp(range));
        if range.is_empty() {
            return Vec::new();
        }
        let mut each = self.split();
        let mut runs = Vec::new();
        for (mip, layer) in positions(range) {
            if let Some(scopes) = step(&mut each[index(shape, mip, layer)], mip, layer) {
                push_single(&mut runs, mip, layer, scopes);
            }
        }
        self.values = PerSubresourceValues::from_each(each);
        join_layers(runs)
    }

    /// Takes the values out, one for every subresource.
    fn split(&mut self) -> Vec<T> {
        match &mut self.values {
            PerSubresourceValues::Same(value) => {
                vec![*value; self.shape.mips as usize * self.shape.layers as usize]
            }
            PerSubresourceValues::Each(each) => std::mem::take(each),
        }
    }
}

impl<T: Copy + PartialEq> PerSubresourceValues<T> {
    /// Stores a single value if all are equal. `each` must not be empty.
    fn from_each(each: Vec<T>) -> Self {
        if each.windows(2).all(|pair| pair[0] == pair[1]) { Self::Same(each[0]) } else { Self::Each(each) }
    }
}

/// Returns the index of a subresource's value. Positions outside the texture map to the last one.
fn index(shape: TextureShape, mip: u32, layer: u32) -> usize {
    let (mips, layers) = (shape.mips as usize, shape.layers as usize);
    (layer as usize * mips + mip as usize).min(mips * layers - 1)
}

fn positions(range: Subresources) -> impl Iterator<Item = (u32, u32)> {
    let layers = range.base_layer..range.base_layer + range.layer_count;
    let mips = range.base_mip..range.base_mip + range.mip_count;
    layers.flat_map(move |layer| mips.clone().map(move |mip| (mip, layer)))
}

fn push_single<S: PartialEq>(runs: &mut Vec<(Subresources, S)>, mip: u32, layer: u32, value: S) {
    if let Some((run, last)) = runs.last_mut()
        && *last == value
        && run.extend_mips(mip, layer)
    {
        return;
    }
    let single = Subresources { base_mip: mip, mip_count: 1, base_layer: layer, layer_count: 1 };
    runs.push((single, value));
}

fn join_layers<S: PartialEq>(runs: Vec<(Subresources, S)>) -> Vec<(Subresources, S)> {
    let mut joined: Vec<(Subresources, S)> = Vec::with_capacity(runs.len());
    for (run, value) in runs {
        let extended =
            joined.iter_mut().rev().any(|(range, same)| *same == value && range.extend_layers(run));
        if !extended {
            joined.push((run, value));
        }
    }
    joined
}
