//! A finished picture.

use tiny_skia::{IntSize, Pixmap};

/// A picture: rows from top to bottom, pixels from left to right, one byte each of red, green and blue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Picture {
    /// A picture of these bytes; `None` if they are not `width` x `height` x 3, or there are none.
    #[must_use]
    pub fn from_rgb(width: u32, height: u32, rgb: Vec<u8>) -> Option<Self> {
        let size = 3 * width as usize * height as usize;
        (size > 0 && rgb.len() == size).then_some(Self { width, height, rgb })
    }

    pub(crate) fn of(pixmap: &Pixmap) -> Self {
        let (pixels, _) = pixmap.data().as_chunks::<4>();
        // An opaque pixel is premultiplied by 1.
        let rgb = pixels.iter().flat_map(|&[red, green, blue, _]| [red, green, blue]).collect();
        Self { width: pixmap.width(), height: pixmap.height(), rgb }
    }

    /// Pixels across.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels from top to bottom.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The bytes, (height, width, 3).
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The picture as a PNG file.
    #[must_use]
    pub fn png(&self) -> Vec<u8> {
        let (pixels, _) = self.rgb.as_chunks::<3>();
        let rgba = pixels.iter().flat_map(|&[red, green, blue]| [red, green, blue, 255]).collect();
        let size = IntSize::from_wh(self.width, self.height).expect("a picture is not empty");
        let pixmap = Pixmap::from_vec(rgba, size).expect("there are four bytes a pixel");
        pixmap.encode_png().expect("a picture in memory can be written to memory")
    }
}
