use image::{ExtendedColorType, ImageEncoder};

use super::*;

/// A PNG file of these bytes.
fn png(size: [u32; 2], colour: ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    image::codecs::png::PngEncoder::new(&mut file)
        .write_image(bytes, size[0], size[1], colour)
        .expect("encoded");
    file
}

fn read(file: &[u8], channels: &[Channel]) -> Result<WeatherImage> {
    WeatherImage::from_bytes(file, "map.png", channels)
}

const ALL: [Channel; 3] = [Channel::Coverage, Channel::Height, Channel::Extinction];

#[test]
fn channels_are_what_they_are_called() {
    let pixels = [255, 0, 128, 0, 51, 255];
    let file = png([2, 1], ExtendedColorType::Rgb8, &pixels);
    let all = read(&file, &ALL).expect("a map");
    assert_eq!(all.size(), [2, 1]);
    // 255 is all of 16 bits; 8 bits stay as they are.
    assert_eq!(all.texels(), [0xffff | 128 << 24, 51 << 16 | 255 << 24]);
    let turned = [Channel::Unused, Channel::Extinction, Channel::Coverage];
    let turned = read(&file, &turned).expect("a map");
    let sixteen = |byte: u32| byte * 257;
    assert_eq!(turned.texels(), [sixteen(128) | 255 << 16, 0xffff | 255 << 16 | 51 << 24]);
    assert_ne!(all.fingerprint(), turned.fingerprint());
}

#[test]
fn grey_alpha_and_sixteen_bits() {
    let coverage = [Channel::Coverage];
    let grey = png([1, 2], ExtendedColorType::L8, &[0, 200]);
    assert_eq!(
        read(&grey, &coverage).expect("a map").texels(),
        [0xffff << 16, (0xffff << 16) | (200 * 257)]
    );
    // What is hidden counts as what is not.
    let hidden = png([1, 2], ExtendedColorType::La8, &[0, 255, 200, 0]);
    assert_eq!(read(&hidden, &coverage).expect("a map"), read(&grey, &coverage).expect("a map"));
    let bytes: Vec<u8> = [1_u16, 32_768, 65_535].into_iter().flat_map(u16::to_ne_bytes).collect();
    let deep = png([3, 1], ExtendedColorType::L16, &bytes);
    let read = read(&deep, &coverage).expect("a map");
    assert_eq!(read.texels().iter().map(|t| t & 0xffff).collect::<Vec<_>>(), [1, 32_768, 65_535]);
}

#[test]
fn what_cannot_be_used_is_told() {
    let grey = png([2, 2], ExtendedColorType::L8, &[0; 4]);
    let cut = &grey[..grey.len() - 20];
    let mut huge = grey.clone();
    huge[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let mut empty = grey.clone();
    empty[16..20].fill(0);
    let mut damaged = grey.clone();
    damaged[24] = 7;
    for (file, part) in [
        (&b""[..], "is no PNG image, expected a PNG image"),
        (b"GIF89a, which is another kind of image", "is no PNG image"),
        (&huge, "is 60000 x 60000 pixels, expected 1 to 4096 a side"),
        (&empty, "is 0 x 2 pixels"),
        (&damaged, "is no sound PNG image: "),
        (cut, "is no sound PNG image: "),
    ] {
        let message = read(file, &[Channel::Coverage]).expect_err(part).to_string();
        assert!(message.starts_with("map.png: "), "{message}");
        assert!(message.contains(part) && !message.contains('\n'), "{message} lacks {part}");
    }
    let message = read(&grey, &ALL).expect_err("three of one").to_string();
    assert!(message.contains("has 1 channel, expected at least 3"), "{message}");
}

#[test]
fn a_file_is_named_so_that_it_is_found() {
    let here = std::env::current_dir().expect("a folder");
    let name = |folder: &str, file: &str| named_from(Path::new(folder), Path::new(file));
    assert_eq!(name("", "maps/a.png"), Path::new("maps/a.png"));
    assert_eq!(name("maps", "maps/a.png"), Path::new("a.png"));
    assert_eq!(name("scenes", "maps/a.png"), here.join("maps/a.png"));
    assert_eq!(name("/some", "/some/where/a.png"), Path::new("where/a.png"));
    assert_eq!(name("/other", "/some/a.png"), Path::new("/some/a.png"));
}

#[test]
fn only_plain_files_are_opened() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let load = |path: &Path| WeatherImage::load(path, &[Channel::Coverage]);
    for (path, part) in [
        (dir.path().to_owned(), "is not a plain file, expected a PNG image"),
        (dir.path().join("none.png"), "there is no such file, expected a PNG image"),
        (PathBuf::from("/dev/zero"), "is not a plain file"),
    ] {
        let error = load(&path).expect_err(part);
        assert_eq!(error.exit_code(), 2, "{error}");
        let message = error.to_string();
        assert!(message.starts_with(&path.display().to_string()), "{message}");
        // Where there is no such device, nothing is opened either.
        assert!(message.contains(part) || message.contains("no such file"), "{message}");
    }
    let path = dir.path().join("strip.png");
    std::fs::write(&path, png([4, 1], ExtendedColorType::L8, &[9; 4])).expect("written");
    let map = WeatherMap::open(&path).expect("a map");
    assert_eq!(map.extent, DVec2::new(20_000.0, 5000.0), "square pixels");
    assert_eq!(map.read_again().expect("the same"), map);
    // Of three meanings that one colour cannot have, the coverage is left.
    assert_eq!(WeatherMap::open_as(&path, &ALL).expect("a map"), map);
    assert_eq!(WeatherMap::open_as(&path, &ALL[1..2]).expect("a map").channels, ALL[1..2]);
}
