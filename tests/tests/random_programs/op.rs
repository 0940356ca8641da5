//! Operations of a program: a kind, and small numbers that are taken modulo the choices there are. Any list of
//! operations is therefore a program, and so is any part of it.

use std::fmt;
use std::str::FromStr;

use lvk_tests::random::Random;

/// Kind of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    CreateBuffer,
    DestroyBuffer,
    UploadBuffer,
    DownloadBuffer,
    ReadBufferLater,
    BufferAddress,
    CreateTexture,
    CreateView,
    DestroyTexture,
    UploadTexture,
    DownloadTexture,
    ReadTextureLater,
    FinishReadback,
    CreateSampler,
    DestroySampler,
    CreateMesh,
    UploadMesh,
    DestroyMesh,
    CreateBlas,
    DestroyBlas,
    CreateTlas,
    DestroyTlas,
    CreateRays,
    DestroyRays,
    Compact,
    AccelInfo,
    Acquire,
    Submit,
    DropCommands,
    RecordOnThreads,
    Wait,
    IsDone,
    WaitIdle,
    Flush,
    NextFrame,
    CopyBuffer,
    CopyRegions,
    FillBuffer,
    UpdateBuffer,
    UpdateTexture,
    BufferToTexture,
    TextureToBuffer,
    CopyTexture,
    ClearTexture,
    Blit,
    Mipmaps,
    DispatchFill,
    DispatchIndirect,
    DispatchCopy,
    ReadUploaded,
    StoreImage,
    FetchTexture,
    Draw,
    Timestamp,
    Label,
    MoveTriangle,
    BuildBlas,
    UpdateTlas,
    Trace,
    TraceRays,
    MapBuffer,
    CreateBlasBatch,
    CompactSeveral,
    AskAccel,
    AskContext,
    AskRaw,
    CreateNearestSampler,
    CreateCube,
    CreateVolume,
    ReadQueries,
    RecordAnyOnThreads,
    DrawIndexed,
    DrawIndirect,
    DrawCounted,
    DrawMesh,
    DrawDepth,
    DrawSamples,
    SampleTexture,
    WriteTime,
    CountSamples,
    UpdateTlasFromBuffer,
    WrongStructure,
    ReloadBlas,
    UploadShared,
    DownloadShared,
    ReplaceShared,
    FillShared,
    CopyToShared,
    CopyFromShared,
    DispatchToShared,
    DispatchFromShared,
    TexelsToShared,
    TexelsFromShared,
    StoreShared,
    FetchShared,
    BuildShared,
    TraceShared,
    UseReplaced,
}

/// Kinds that record a command, of which `RecordOnThreads` chooses. Kept programs need this table as it is: newer kinds
/// belong to [`RECORDED_LATER`].
const RECORDED: [(Kind, u16); 25] = [
    (Kind::CopyBuffer, 6),
    (Kind::CopyRegions, 3),
    (Kind::FillBuffer, 6),
    (Kind::UpdateBuffer, 5),
    (Kind::UpdateTexture, 4),
    (Kind::BufferToTexture, 5),
    (Kind::TextureToBuffer, 5),
    (Kind::CopyTexture, 5),
    (Kind::ClearTexture, 4),
    (Kind::Blit, 4),
    (Kind::Mipmaps, 2),
    (Kind::DispatchFill, 4),
    (Kind::DispatchIndirect, 2),
    (Kind::DispatchCopy, 4),
    (Kind::ReadUploaded, 3),
    (Kind::StoreImage, 3),
    (Kind::FetchTexture, 3),
    (Kind::Draw, 3),
    (Kind::Timestamp, 1),
    (Kind::Label, 2),
    (Kind::MoveTriangle, 3),
    (Kind::BuildBlas, 3),
    (Kind::UpdateTlas, 6),
    (Kind::Trace, 8),
    (Kind::TraceRays, 4),
];

/// Kinds that record a command, of which `RecordAnyOnThreads` chooses beside those of [`RECORDED`]. Kept programs
/// need this table as it is too. Traces are chosen more often than that table says, as few of them hit.
const RECORDED_LATER: [(Kind, u16); 13] = [
    (Kind::DrawIndexed, 4),
    (Kind::DrawIndirect, 4),
    (Kind::DrawCounted, 4),
    (Kind::DrawMesh, 4),
    (Kind::DrawDepth, 3),
    (Kind::DrawSamples, 3),
    (Kind::SampleTexture, 3),
    (Kind::WriteTime, 3),
    (Kind::CountSamples, 3),
    (Kind::UpdateTlasFromBuffer, 4),
    (Kind::WrongStructure, 1),
    (Kind::Trace, 6),
    (Kind::TraceRays, 3),
];

/// Kinds that record a command on objects that threads share.
const RECORDED_SHARED: [(Kind, u16); 12] = [
    (Kind::FillShared, 2),
    (Kind::CopyToShared, 2),
    (Kind::CopyFromShared, 2),
    (Kind::DispatchToShared, 2),
    (Kind::DispatchFromShared, 2),
    (Kind::TexelsToShared, 2),
    (Kind::TexelsFromShared, 2),
    (Kind::StoreShared, 2),
    (Kind::FetchShared, 2),
    (Kind::BuildShared, 2),
    (Kind::TraceShared, 3),
    (Kind::UseReplaced, 4),
];

/// Calls of the context.
const CALLED: [(Kind, u16); 50] = [
    (Kind::CreateBuffer, 4),
    (Kind::DestroyBuffer, 2),
    (Kind::UploadBuffer, 5),
    (Kind::DownloadBuffer, 2),
    (Kind::ReadBufferLater, 2),
    (Kind::BufferAddress, 2),
    (Kind::CreateTexture, 4),
    (Kind::CreateView, 3),
    (Kind::DestroyTexture, 2),
    (Kind::UploadTexture, 4),
    (Kind::DownloadTexture, 2),
    (Kind::ReadTextureLater, 2),
    (Kind::FinishReadback, 3),
    (Kind::CreateSampler, 1),
    (Kind::DestroySampler, 1),
    (Kind::CreateMesh, 4),
    (Kind::UploadMesh, 2),
    (Kind::DestroyMesh, 1),
    (Kind::CreateBlas, 6),
    (Kind::DestroyBlas, 1),
    (Kind::CreateTlas, 7),
    (Kind::DestroyTlas, 1),
    (Kind::CreateRays, 2),
    (Kind::DestroyRays, 1),
    (Kind::Compact, 1),
    (Kind::AccelInfo, 1),
    (Kind::Acquire, 5),
    (Kind::Submit, 9),
    (Kind::DropCommands, 1),
    (Kind::RecordOnThreads, 1),
    (Kind::Wait, 2),
    (Kind::IsDone, 2),
    (Kind::WaitIdle, 1),
    (Kind::Flush, 1),
    (Kind::NextFrame, 1),
    (Kind::MapBuffer, 3),
    (Kind::CreateBlasBatch, 3),
    (Kind::CompactSeveral, 1),
    (Kind::AskAccel, 1),
    (Kind::AskContext, 2),
    (Kind::AskRaw, 1),
    (Kind::CreateNearestSampler, 1),
    (Kind::CreateCube, 1),
    (Kind::CreateVolume, 1),
    (Kind::ReadQueries, 3),
    (Kind::RecordAnyOnThreads, 1),
    (Kind::ReloadBlas, 2),
    (Kind::UploadShared, 2),
    (Kind::DownloadShared, 2),
    (Kind::ReplaceShared, 1),
];

/// An operation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Op {
    /// Thread that runs it; 0 in programs of one thread.
    pub thread: u8,
    /// Kind.
    pub kind: Kind,
    /// Numbers that choose objects, ranges and mistakes.
    pub n: [u16; 6],
}

/// Returns an operation of the first thread.
pub fn op(kind: Kind, n: [u16; 6]) -> Op {
    Op { thread: 0, kind, n }
}

impl fmt::Display for Op {
    /// Writes `FillBuffer 3 0 12`, and `FillBuffer@1 3 0 12` for another thread than the first. Zeros at the end are left
    /// out.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:?}", self.kind)?;
        if self.thread > 0 {
            write!(out, "@{}", self.thread)?;
        }
        let length = self.n.iter().rposition(|number| *number > 0).map_or(0, |last| last + 1);
        self.n[..length].iter().try_for_each(|number| write!(out, " {number}"))
    }
}

impl fmt::Debug for Op {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, out)
    }
}

impl FromStr for Op {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let error = |what: &str| format!("'{line}' {what}; write KIND or KIND@THREAD, and up to six numbers");
        let mut words = line.split_whitespace();
        let head = words.next().unwrap_or_default();
        let (name, thread) = head.split_once('@').unwrap_or((head, "0"));
        let kind =
            Kind::all().find(|kind| format!("{kind:?}") == name).ok_or_else(|| error("has no known kind"))?;
        let thread = thread.parse().map_err(|_| error("has no number of a thread"))?;
        let mut op = Self { thread, ..op(kind, [0; 6]) };
        let mut places = op.n.iter_mut();
        for word in words {
            let place = places.next().ok_or_else(|| error("has more than six numbers"))?;
            *place = word.parse().map_err(|_| error("has a number that does not fit 16 bits"))?;
        }
        Ok(op)
    }
}

/// Returns the text of a program, an operation a line.
pub fn write_program(ops: &[Op]) -> String {
    ops.iter().map(|op| format!("{op}\n")).collect()
}

/// Returns the program of a text. Empty lines and those that start with `#` do not count.
///
/// # Errors
/// The first line that is no operation.
pub fn parse_program(text: &str) -> Result<Vec<Op>, String> {
    let lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    lines.map(str::parse).collect()
}

impl Kind {
    /// Returns the kinds that change what the model knows of the contents of an object.
    pub fn with_effect() -> Vec<Self> {
        // Texts of labels, and a time that no query of the model has; a wrong structure is refused; the shared BLAS is built of
        // the same triangles.
        const NONE: [Kind; 4] = [Kind::Label, Kind::Timestamp, Kind::WrongStructure, Kind::BuildShared];
        let mut kinds = vec![
            Self::MapBuffer,
            Self::UploadBuffer,
            Self::UploadTexture,
            Self::UploadMesh,
            Self::CreateBlas,
            Self::CreateBlasBatch,
            Self::ReloadBlas,
            Self::CreateTlas,
            Self::UploadShared,
        ];
        for (kind, _) in RECORDED.iter().chain(&RECORDED_LATER).chain(&RECORDED_SHARED) {
            if !NONE.contains(kind) && !kinds.contains(kind) {
                kinds.push(*kind);
            }
        }
        kinds
    }

    /// Returns every kind.
    pub fn all() -> impl Iterator<Item = Self> {
        CALLED.iter().chain(&RECORDED).chain(&RECORDED_LATER).chain(&RECORDED_SHARED).map(|(kind, _)| *kind)
    }
}

impl Op {
    /// Returns a random operation.
    pub fn random(random: &mut Random) -> Self {
        Self::random_of(&[&CALLED, &RECORDED, &RECORDED_LATER, &RECORDED_SHARED], random)
    }

    /// Returns a random operation that records a command, of the kinds of `RecordOnThreads`.
    pub fn random_recorded(random: &mut Random) -> Self {
        Self::random_of(&[&RECORDED], random)
    }

    /// Returns a random operation that records a command of any kind.
    pub fn random_recorded_of_any_kind(random: &mut Random) -> Self {
        Self::random_of(&[&RECORDED, &RECORDED_LATER], random)
    }

    fn random_of(tables: &[&[(Kind, u16)]], random: &mut Random) -> Self {
        let kinds: Vec<_> = tables.concat();
        let total: u16 = kinds.iter().map(|(_, weight)| weight).sum();
        let at = (random.bits() % u64::from(total)) as u16;
        op(kind_at(&kinds, at), numbers(random))
    }
}

/// Returns the program of a seed.
pub fn program(seed: u64, length: usize) -> Vec<Op> {
    let mut random = Random::new(seed);
    (0..length).map(|_| Op::random(&mut random)).collect()
}

fn numbers(random: &mut Random) -> [u16; 6] {
    let (low, high) = (random.bits(), random.bits());
    [low, low >> 16, low >> 32, high, high >> 16, high >> 32].map(|bits| bits as u16)
}

/// Returns the kind whose range of weights contains `at`.
fn kind_at(kinds: &[(Kind, u16)], mut at: u16) -> Kind {
    for (kind, weight) in kinds {
        if at < *weight {
            return *kind;
        }
        at -= weight;
    }
    kinds[0].0
}

#[test]
fn a_seed_is_one_program_with_every_kind() {
    let ops = program(3, 5_000);
    assert_eq!(ops, program(3, 5_000));
    let kinds: std::collections::HashSet<Kind> = ops.iter().map(|op| op.kind).collect();
    assert_eq!(kinds, Kind::all().collect());
}

/// The commands of `RecordOnThreads` and `RecordAnyOnThreads` follow from their numbers, also in programs that were kept long ago.
#[test]
fn kept_programs_record_the_same_commands_on_threads() {
    let mut random = Random::new(7);
    let ops: Vec<Op> = (0..3).map(|_| Op::random_recorded(&mut random)).collect();
    let expected = "FillBuffer 26140 62524 15575 10754 47793 16512
UpdateBuffer 8666 27166 15206 43537 52158 48774
DispatchIndirect 48894 15618 54865 26465 39248 49274
";
    assert_eq!(write_program(&ops), expected);
    let ops: Vec<Op> = (0..3).map(|_| Op::random_recorded_of_any_kind(&mut random)).collect();
    let expected = "MoveTriangle 64235 1461 59291 25388 10461 20151
ClearTexture 25648 41729 39204 5606 2911 39725
ReadUploaded 54959 27859 23808 9927 55923 27148
";
    assert_eq!(write_program(&ops), expected);
}

#[test]
fn programs_come_back_from_their_text() {
    let mut ops = program(3, 5_000);
    ops.iter_mut().zip((0..5).cycle()).for_each(|(op, thread)| (op.thread, op.n[5]) = (thread, 0));
    assert_eq!(parse_program(&write_program(&ops)), Ok(ops));
    let text = "# two operations\n\nFillBuffer 3 0 12\nWaitIdle@2\n";
    let ops = [op(Kind::FillBuffer, [3, 0, 12, 0, 0, 0]), Op { thread: 2, ..op(Kind::WaitIdle, [0; 6]) }];
    assert_eq!(parse_program(text), Ok(ops.to_vec()));
    assert_eq!(write_program(&ops), "FillBuffer 3 0 12\nWaitIdle@2\n");
}

#[test]
fn lines_that_are_no_operations_are_refused() {
    for line in ["Fly 1", "Label@", "Label@256", "Label x", "Label 65536", "Label 1 2 3 4 5 6 7", "@1"] {
        let error = parse_program(&format!("WaitIdle\n{line}\n"));
        assert!(error.is_err_and(|error| error.starts_with(&format!("'{line}' has "))), "{line}");
    }
}
