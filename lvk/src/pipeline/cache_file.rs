//! The format of the pipeline cache file: its owner, its checksum and the data of Vulkan.

use crate::cache_file::checksum;

/// The device and the driver that compiled the shaders of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct CacheOwner {
    pub(crate) vendor: u32,
    pub(crate) device: u32,
    pub(crate) driver_version: u32,
    pub(crate) driver_uuid: [u8; 16],
    /// `pipelineCacheUUID`; drivers change it with the format of their compiled shaders.
    pub(crate) cache_uuid: [u8; 16],
}

/// The reason why a file is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum CacheRejection {
    #[error("it is no pipeline cache")]
    NoCache,
    #[error("it was written by another version of the library")]
    OtherFormat,
    #[error("it is damaged or cut off")]
    Damaged,
    #[error("it was written by another version of the driver")]
    OtherDriver,
    #[error("it was written for another device or driver")]
    OtherDevice,
}

const MAGIC: [u8; 8] = *b"lvkpipes";
const FORMAT: u32 = 1;
/// Size of the header: magic, format, driver version, driver UUID, length of Vulkan's data, checksum of everything
/// else.
const HEADER_BYTES: usize = 48;
const CHECKSUM_AT: usize = 40;
/// Size of `VkPipelineCacheHeaderVersionOne`: length, version, vendor, device, UUID.
const VULKAN_HEADER_BYTES: usize = 32;
const VULKAN_HEADER_VERSION: u32 = 1;

/// Returns the file that holds Vulkan's `data`.
pub(crate) fn encode_file(owner: &CacheOwner, data: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(HEADER_BYTES + data.len());
    file.extend(MAGIC);
    file.extend(FORMAT.to_le_bytes());
    file.extend(owner.driver_version.to_le_bytes());
    file.extend(owner.driver_uuid);
    file.extend((data.len() as u64).to_le_bytes());
    let sum = checksum(&[&file, data]);
    file.extend(sum.to_le_bytes());
    file.extend(data);
    file
}

/// Returns Vulkan's data of a file that is complete and was written by `owner`.
pub(crate) fn decode_file<'a>(owner: &CacheOwner, file: &'a [u8]) -> Result<&'a [u8], CacheRejection> {
    if !file.starts_with(&MAGIC) {
        return Err(CacheRejection::NoCache);
    }
    if file.len() < HEADER_BYTES {
        return Err(CacheRejection::Damaged);
    }
    let (header, data) = file.split_at(HEADER_BYTES);
    if read_word(header, 8) != Some(FORMAT) {
        return Err(CacheRejection::OtherFormat);
    }
    let (covered, sum) = header.split_at(CHECKSUM_AT);
    if covered[32..] != (data.len() as u64).to_le_bytes() || *sum != checksum(&[covered, data]).to_le_bytes()
    {
        return Err(CacheRejection::Damaged);
    }
    if read_word(header, 12) != Some(owner.driver_version) || header[16..32] != owner.driver_uuid {
        return Err(CacheRejection::OtherDriver);
    }
    check_vulkan_header(owner, data)?;
    Ok(data)
}

/// Fails unless Vulkan's own header matches the driver. Drivers must ignore foreign data themselves, but not every
/// driver does.
fn check_vulkan_header(owner: &CacheOwner, data: &[u8]) -> Result<(), CacheRejection> {
    let Some(header) = data.get(..VULKAN_HEADER_BYTES) else { return Err(CacheRejection::Damaged) };
    let length = read_word(header, 0).map_or(0, |length| length as usize);
    if length < VULKAN_HEADER_BYTES
        || length > data.len()
        || read_word(header, 4) != Some(VULKAN_HEADER_VERSION)
    {
        return Err(CacheRejection::Damaged);
    }
    let same = read_word(header, 8) == Some(owner.vendor)
        && read_word(header, 12) == Some(owner.device)
        && header[16..32] == owner.cache_uuid;
    if same { Ok(()) } else { Err(CacheRejection::OtherDevice) }
}

fn read_word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const OWNER: CacheOwner = CacheOwner {
        vendor: 0x10de,
        device: 0x2684,
        driver_version: 99,
        driver_uuid: [7; 16],
        cache_uuid: [9; 16],
    };

    /// Returns cache data as a driver of `owner` writes it, with `body` after the header.
    fn data_of(owner: &CacheOwner, body: &[u8]) -> Vec<u8> {
        let words = [32, VULKAN_HEADER_VERSION, owner.vendor, owner.device];
        let header = words.iter().flat_map(|word| word.to_le_bytes()).chain(owner.cache_uuid);
        header.chain(body.iter().copied()).collect()
    }

    proptest! {
        #[test]
        fn sealed_data_is_read_again(body in prop::collection::vec(any::<u8>(), 0..300)) {
            let data = data_of(&OWNER, &body);
            let file = encode_file(&OWNER, &data);
            prop_assert_eq!(decode_file(&OWNER, &file), Ok(&data[..]));
        }

        #[test]
        fn every_change_of_a_bit_is_seen(
            body in prop::collection::vec(any::<u8>(), 0..100), at in any::<prop::sample::Index>(), bit in 0..8_u32
        ) {
            let mut file = encode_file(&OWNER, &data_of(&OWNER, &body));
            let at = at.index(file.len());
            file[at] ^= 1 << bit;
            prop_assert!(decode_file(&OWNER, &file).is_err());
        }

        #[test]
        fn truncated_and_lengthened_files_are_noticed(
            body in prop::collection::vec(any::<u8>(), 0..100),
            more in prop::collection::vec(any::<u8>(), 1..50), cut in any::<prop::sample::Index>()
        ) {
            let file = encode_file(&OWNER, &data_of(&OWNER, &body));
            prop_assert!(decode_file(&OWNER, &file[..cut.index(file.len())]).is_err());
            let longer = [&file[..], &more].concat();
            prop_assert_eq!(decode_file(&OWNER, &longer), Err(CacheRejection::Damaged));
        }

        #[test]
        fn random_bytes_are_refused(mut bytes in prop::collection::vec(any::<u8>(), 0..200), named in any::<bool>()) {
            if named {
                bytes.splice(0..0, [&MAGIC[..], &FORMAT.to_le_bytes()].concat());
            }
            prop_assert!(decode_file(&OWNER, &bytes).is_err());
        }

        #[test]
        fn random_data_of_the_driver_is_refused(data in prop::collection::vec(any::<u8>(), 0..100)) {
            prop_assert!(decode_file(&OWNER, &encode_file(&OWNER, &data)).is_err());
        }
    }

    #[test]
    fn another_device_or_driver_is_named() {
        let file = encode_file(&OWNER, &data_of(&OWNER, &[1; 40]));
        let others = [
            (CacheOwner { vendor: 1, ..OWNER }, CacheRejection::OtherDevice),
            (CacheOwner { device: 1, ..OWNER }, CacheRejection::OtherDevice),
            (CacheOwner { cache_uuid: [1; 16], ..OWNER }, CacheRejection::OtherDevice),
            (CacheOwner { driver_version: 1, ..OWNER }, CacheRejection::OtherDriver),
            (CacheOwner { driver_uuid: [1; 16], ..OWNER }, CacheRejection::OtherDriver),
        ];
        for (owner, refusal) in others {
            assert_eq!(decode_file(&owner, &file), Err(refusal), "{owner:?}");
        }
        assert_eq!(decode_file(&OWNER, b"\x7fELF and so on"), Err(CacheRejection::NoCache));
        let mut newer = file;
        newer[8] = 2;
        assert_eq!(decode_file(&OWNER, &newer), Err(CacheRejection::OtherFormat));
    }

    #[test]
    fn a_header_that_is_longer_than_the_data_is_damage() {
        for length in [0_u32, 31, 73, u32::MAX] {
            let mut data = data_of(&OWNER, &[1; 40]);
            data[..4].copy_from_slice(&length.to_le_bytes());
            assert_eq!(decode_file(&OWNER, &encode_file(&OWNER, &data)), Err(CacheRejection::Damaged));
        }
    }
}
