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

    /// A picture of a pixmap whose pixels are opaque.
    pub(crate) fn of(pixmap: &Pixmap) -> Self {
        let (width, height) = (pixmap.width(), pixmap.height());
        let mut picture = Self { width, height, rgb: vec![0; 3 * pixmap.pixels().len()] };
        picture.put(pixmap, 0, 0);
        picture
    }

    /// Puts a pixmap whose pixels are opaque where its upper left corner is at `left` and `top`; it lies within.
    pub(crate) fn put(&mut self, pixmap: &Pixmap, left: u32, top: u32) {
        let (across, width) = (3 * self.width as usize, pixmap.width() as usize);
        let first = top as usize * across + 3 * left as usize;
        let rows = pixmap.data().chunks_exact(4 * width);
        for (below, row) in self.rgb[first..].chunks_mut(across).zip(rows) {
            // An opaque pixel is premultiplied by 1.
            let (pixels, _) = row.as_chunks::<4>();
            let (places, _) = below[..3 * width].as_chunks_mut::<3>();
            for (place, &[red, green, blue, _]) in places.iter_mut().zip(pixels) {
                *place = [red, green, blue];
            }
        }
    }

    /// Pictures of one size side by side, so many in a row; white where the last row is not full.
    ///
    /// # Panics
    ///
    /// If there are none, or they have different sizes, or `columns` is 0.
    #[must_use]
    pub fn tiled(pictures: &[Self], columns: usize) -> Self {
        let (width, height) = (pictures[0].width, pictures[0].height);
        assert!(
            pictures.iter().all(|tile| (tile.width, tile.height) == (width, height)),
            "tiles have one size"
        );
        let bytes = 3 * width as usize;
        let mut rgb = Vec::with_capacity(bytes * height as usize * pictures.len());
        for tiles in pictures.chunks(columns) {
            for row in 0..height as usize {
                for tile in tiles {
                    rgb.extend_from_slice(&tile.rgb[row * bytes..(row + 1) * bytes]);
                }
                let missing = columns.min(pictures.len()) - tiles.len();
                rgb.resize(rgb.len() + missing * bytes, u8::MAX);
            }
        }
        let across = width * u32::try_from(columns.min(pictures.len())).expect("pictures are few");
        let down =
            height * u32::try_from(pictures.len().div_ceil(columns)).expect("pictures are few");
        Self { width: across, height: down, rgb }
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

    /// The bytes without the picture.
    #[must_use]
    pub fn into_rgb(self) -> Vec<u8> {
        self.rgb
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
