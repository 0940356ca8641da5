//! Accessors: typed elements in buffer views, sparse ones included.

use std::borrow::Cow;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::budget::Budget;
use super::buffers::Buffers;
use super::document::Document;
use super::place::place;
use super::source::Source;
use crate::Problem;

/// What reads accessors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Accessors<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers<'a>,
    pub(super) budget: &'a Budget,
}

/// An accessor whose bytes are all there.
#[derive(Debug, Clone)]
pub(super) struct Accessor<'a> {
    budget: &'a Budget,
    /// The object, and the accessor.
    pub(super) place: String,
    /// Number of elements.
    pub(super) count: u64,
    /// Type of a component.
    pub(super) component: ComponentType,
    /// Shape of an element.
    pub(super) shape: Type,
    /// Whether integers stand for numbers from -1 or 0 to 1.
    pub(super) normalized: bool,
    /// Elements, or none for zeros.
    elements: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements at equal distances.
#[derive(Debug, Clone, Copy)]
struct Strided<'a> {
    source: Source<'a>,
    count: u64,
    stride: usize,
    size: usize,
}

/// Elements that take the place of others.
#[derive(Debug, Clone)]
struct Sparse<'a> {
    /// Which elements are replaced. They rise.
    indices: Vec<u32>,
    values: Strided<'a>,
}

/// Bytes of a file that are read at once.
const READ_BYTES: u64 = 1 << 18;

impl Strided<'_> {
    /// Calls `visit` with each element and its index, in order. Of a file only a few elements are in memory at a time.
    fn each(&self, mut visit: impl FnMut(usize, &[u8])) -> Result<(), Problem> {
        let (stride, size) = (self.stride.max(1) as u64, self.size as u64);
        let most = match self.source {
            Source::Memory(_) => u64::MAX,
            Source::File { .. } => (READ_BYTES / stride).max(1),
        };
        let mut first = 0;
        while first < self.count {
            let count = most.min(self.count - first);
            let part = self.source.part(first * stride, (count - 1) * stride + size);
            let bytes = part.map_or(Ok(Cow::default()), |part| part.read())?;
            for (number, element) in bytes.chunks(self.stride.max(1)).enumerate() {
                visit(first as usize + number, &element[..self.size.min(element.len())]);
            }
            first += count;
        }
        Ok(())
    }
}

impl<'a> Accessors<'a> {
    /// Finds the bytes of an accessor that `user` refers to, such as `mesh 3 'Body', primitive 1`.
    pub(super) fn open(&self, index: usize, user: &str) -> Result<Accessor<'a>, Problem> {
        let Some(accessor) = self.document.root.accessors.get(index) else {
            let count = self.document.root.accessors.len() as u64;
            return Err(Problem::OutOfRange {
                place: user.into(),
                what: "accessor",
                index: index as u64,
                count,
            });
        };
        let name = || format!("{user}, {}", place("accessor", index, accessor.name.as_deref()));
        let (Checked::Valid(component), Checked::Valid(shape)) = (accessor.component_type, accessor.type_)
        else {
            return Err(Problem::Rule { place: name(), rule: "its type is unknown".into() });
        };
        let component = component.0;
        if accessor.count.0 > u64::from(u32::MAX) {
            return Err(Problem::Rule { place: name(), rule: "it has 2^32 elements or more".into() });
        }
        let size = component.size() * shape.multiplicity();
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let view = accessor.buffer_view.map(|view| view.value());
        let elements =
            view.map(|view| self.strided(view, offset, accessor.count.0, size, &name)).transpose()?;
        let sparse = accessor.sparse.as_ref();
        let sparse =
            sparse.map(|sparse| self.open_sparse(sparse, accessor.count.0, size, &name)).transpose()?;
        Ok(Accessor {
            budget: self.budget,
            place: name(),
            count: accessor.count.0,
            component,
            shape,
            normalized: accessor.normalized,
            elements,
            sparse,
        })
    }

    fn strided(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        place: &dyn Fn() -> String,
    ) -> Result<Strided<'a>, Problem> {
        let source = self.buffers.view(self.document, view)?;
        let stride = self.document.root.buffer_views[view].byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            let rule = format!("its elements of {size} bytes overlap, as they are {stride} bytes apart");
            return Err(Problem::Rule { place: place(), rule });
        }
        let length = if count == 0 { 0 } else { u128::from(count - 1) * stride as u128 + size as u128 };
        let end = u128::from(offset) + length;
        let part = u64::try_from(length).ok().and_then(|length| source.part(offset, length));
        part.map(|source| Strided { source, count, stride, size }).ok_or_else(|| Problem::Truncated {
            place: place(),
            end,
            what: format!("buffer view {view}"),
            length: source.length(),
        })
    }

    fn open_sparse(
        &self,
        sparse: &gltf::json::accessor::sparse::Sparse,
        count: u64,
        size: usize,
        place: &dyn Fn() -> String,
    ) -> Result<Sparse<'a>, Problem> {
        if sparse.count.0 > count {
            let place = format!("the sparse part of {}", place());
            return Err(Problem::Count { place, found: sparse.count.0, wanted: count });
        }
        let Checked::Valid(index) = sparse.indices.component_type else {
            return Err(Problem::Rule {
                place: place(),
                rule: "its sparse indices have an unknown type".into(),
            });
        };
        let part = |what: &'static str| move || format!("the sparse {what} of {}", place());
        let (indices, values) = (&sparse.indices, &sparse.values);
        let view = indices.buffer_view.value();
        let index_bytes = index.0.size();
        let indices =
            self.strided(view, indices.byte_offset.0, sparse.count.0, index_bytes, &part("indices"))?;
        let view = values.buffer_view.value();
        let values = self.strided(view, values.byte_offset.0, sparse.count.0, size, &part("values"))?;
        let indices = self.sparse_indices(&indices, count, place)?;
        Ok(Sparse { indices, values })
    }

    fn sparse_indices(
        &self,
        elements: &Strided<'_>,
        count: u64,
        place: &dyn Fn() -> String,
    ) -> Result<Vec<u32>, Problem> {
        let mut indices: Vec<u32> = self.budget.list(elements.count, place)?;
        elements.each(|_, bytes| {
            let mut index = [0; 4];
            index.iter_mut().zip(bytes).for_each(|(byte, of_file)| *byte = *of_file);
            indices.push(u32::from_le_bytes(index));
        })?;
        if let Some(index) = indices.iter().find(|index| u64::from(**index) >= count) {
            let index = u64::from(*index);
            return Err(Problem::OutOfRange { place: place(), what: "sparse index", index, count });
        }
        if !indices.is_sorted_by(|before, after| before < after) {
            return Err(Problem::Rule { place: place(), rule: "its sparse indices do not rise".into() });
        }
        Ok(indices)
    }
}

impl Accessor<'_> {
    /// Reads all elements. `convert` gets the bytes of one.
    pub(super) fn read<T: Clone>(&self, convert: impl Fn(&[u8]) -> T) -> Result<Vec<T>, Problem> {
        let mut list = self.budget.list(self.count, || self.place.clone())?;
        match &self.elements {
            Some(elements) => elements.each(|_, bytes| list.push(convert(bytes)))?,
            None => {
                let size = self.component.size() * self.shape.multiplicity();
                list.resize(self.count as usize, convert(&vec![0; size]));
            }
        }
        if let Some(Sparse { indices, values }) = &self.sparse {
            values.each(|entry, bytes| list[indices[entry] as usize] = convert(bytes))?;
        }
        Ok(list)
    }

    /// Reads elements as `N` floats, of which the accessor has at most as many. Missing components are `fill`. Normalised
    /// integers become numbers from -1 or 0 to 1.
    pub(super) fn read_floats<const N: usize>(&self, fill: f32) -> Result<Vec<[f32; N]>, Problem> {
        let decode = self.decoder();
        let size = self.component.size();
        let list = self.read(|bytes| {
            let mut element = [fill; N];
            element
                .iter_mut()
                .zip(bytes.chunks_exact(size))
                .for_each(|(number, bytes)| *number = decode(bytes));
            element
        })?;
        match list.iter().position(|element| !element.iter().all(|number| number.is_finite())) {
            None => Ok(list),
            Some(index) => {
                Err(Problem::NotFinite { place: self.place.clone(), what: format!("element {index}") })
            }
        }
    }

    /// Reads the components of all elements as floats, one after the other.
    pub(super) fn read_flat(&self) -> Result<Vec<f32>, Problem> {
        match self.shape {
            Type::Scalar => self.read_floats::<1>(0.0).map(Vec::into_flattened),
            Type::Vec3 => self.read_floats::<3>(0.0).map(Vec::into_flattened),
            Type::Vec4 => self.read_floats::<4>(0.0).map(Vec::into_flattened),
            _ => Err(self.wrong_type("SCALAR, VEC3 or VEC4")),
        }
    }

    /// Reads scalars as unsigned integers.
    pub(super) fn read_indices(&self) -> Result<Vec<u32>, Problem> {
        let is_unsigned =
            matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if self.shape != Type::Scalar || !is_unsigned || self.normalized {
            return Err(self.wrong_type("SCALAR of unsigned integers"));
        }
        match self.component {
            ComponentType::U8 => self.read(|bytes| u32::from(bytes[0])),
            ComponentType::U16 => self.read(|bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))),
            _ => self.read(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
        }
    }

    /// Returns the error that the type is not one of those that are needed.
    pub(super) fn wrong_type(&self, wanted: &'static str) -> Problem {
        let shape = match self.shape {
            Type::Scalar => "SCALAR",
            Type::Vec2 => "VEC2",
            Type::Vec3 => "VEC3",
            Type::Vec4 => "VEC4",
            Type::Mat2 => "MAT2",
            Type::Mat3 => "MAT3",
            Type::Mat4 => "MAT4",
        };
        let component = match self.component {
            ComponentType::I8 => "BYTE",
            ComponentType::U8 => "UNSIGNED_BYTE",
            ComponentType::I16 => "SHORT",
            ComponentType::U16 => "UNSIGNED_SHORT",
            ComponentType::U32 => "UNSIGNED_INT",
            ComponentType::F32 => "FLOAT",
        };
        let normalized = if self.normalized { ", normalized" } else { "" };
        Problem::AccessorType {
            place: self.place.clone(),
            found: format!("{shape} of {component}{normalized}"),
            wanted,
        }
    }

    /// Checks that there are as many elements as those of another list.
    pub(super) fn check_count(&self, wanted: u64) -> Result<(), Problem> {
        if self.count == wanted {
            return Ok(());
        }
        Err(Problem::Count { place: self.place.clone(), found: self.count, wanted })
    }

    /// Returns what turns the bytes of a component into a float.
    fn decoder(&self) -> fn(&[u8]) -> f32 {
        match (self.component, self.normalized) {
            (ComponentType::I8, true) => |bytes| (f32::from(bytes[0] as i8) / 127.0).max(-1.0),
            (ComponentType::I8, false) => |bytes| f32::from(bytes[0] as i8),
            (ComponentType::U8, true) => |bytes| f32::from(bytes[0]) / 255.0,
            (ComponentType::U8, false) => |bytes| f32::from(bytes[0]),
            (ComponentType::I16, true) => {
                |bytes| (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])) / 32767.0).max(-1.0)
            }
            (ComponentType::I16, false) => |bytes| f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            (ComponentType::U16, true) => {
                |bytes| f32::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0
            }
            (ComponentType::U16, false) => |bytes| f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            (ComponentType::U32, _) => {
                |bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32
            }
            (ComponentType::F32, _) => |bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}
