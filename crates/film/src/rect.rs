//! Rectangles of pixels, and how to cut them.

/// A rectangle of pixels; `x` runs to the right and `y` down, from the top left corner of the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Rect {
    /// The rectangle of a whole picture.
    #[must_use]
    pub fn full(width: u32, height: u32) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether pixel (`x`, `y`) lies inside.
    #[inline]
    #[must_use]
    pub fn contains(&self, x: u32, y: u32) -> bool {
        x >= self.x && y >= self.y && x - self.x < self.width && y - self.y < self.height
    }

    /// Whether all of `other` lies inside.
    #[must_use]
    pub fn contains_rect(&self, other: &Self) -> bool {
        let end = |start: u32, length: u32| u64::from(start) + u64::from(length);
        other.x >= self.x
            && other.y >= self.y
            && end(other.x, other.width) <= end(self.x, self.width)
            && end(other.y, other.height) <= end(self.y, self.height)
    }

    /// What is in both, if anything is.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let end = |start: u32, length: u32| start.saturating_add(length);
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = end(self.x, self.width).min(end(other.x, other.width));
        let bottom = end(self.y, self.height).min(end(other.y, other.height));
        (x < right && y < bottom).then(|| Self { x, y, width: right - x, height: bottom - y })
    }

    /// The smallest rectangle that has both inside.
    #[must_use]
    pub fn hull(&self, other: &Self) -> Self {
        let end = |start: u32, length: u32| start.saturating_add(length);
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = end(self.x, self.width).max(end(other.x, other.width));
        let bottom = end(self.y, self.height).max(end(other.y, other.height));
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// Tile number `index` (from 0) of `count`, which cover the rectangle without overlap: rows of tiles that are about
    /// square and of about the same area.
    ///
    /// `None` if there is no such tile: `index` is too large, or the rectangle is too small for so many tiles.
    #[must_use]
    pub fn tile(&self, index: u32, count: u32) -> Option<Self> {
        if index >= count || self.area() == 0 {
            return None;
        }
        // Rows of at least two pixels have room for one more tile than their neighbours.
        let square =
            (f64::from(count) * f64::from(self.height) / f64::from(self.width)).sqrt().round() as u32;
        let rows = square.max(count.div_ceil(self.width)).clamp(1, count.min(self.height / 2).max(1));
        let cut = |length: u32, i: u32, n: u32| (u64::from(length) * u64::from(i) / u64::from(n)) as u32;
        let row = (0..rows).find(|row| index < cut(count, row + 1, rows))?;
        let (first, end) = (cut(count, row, rows), cut(count, row + 1, rows));
        let (column, columns) = (index - first, end - first);
        let (top, bottom) = (cut(self.height, first, count), cut(self.height, end, count));
        let (left, right) = (cut(self.width, column, columns), cut(self.width, column + 1, columns));
        let tile = Self { x: self.x + left, y: self.y + top, width: right - left, height: bottom - top };
        (columns <= self.width).then_some(tile)
    }

    /// The number of pixels.
    #[must_use]
    pub fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Cuts the rectangle into tiles of `side` × `side` pixels, row by row; those at the right and bottom edges may
    /// be smaller. `side` zero counts as one.
    pub fn tiles(self, side: u32) -> impl Iterator<Item = Self> {
        let side = side.max(1);
        let offsets = move |length: u32| (0..length).step_by(side as usize);
        offsets(self.height).flat_map(move |dy| {
            offsets(self.width).map(move |dx| Self {
                x: self.x + dx,
                y: self.y + dy,
                width: side.min(self.width - dx),
                height: side.min(self.height - dy),
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_rectangle_once() {
        let rect = Rect { x: 5, y: 7, width: 31, height: 17 };
        for count in 1..=40 {
            let tiles: Vec<Rect> = (0..count).map(|i| rect.tile(i, count).unwrap()).collect();
            assert_eq!(tiles.iter().map(Rect::area).sum::<usize>(), rect.area(), "{count}");
            let areas = tiles.iter().map(Rect::area);
            let (least, most) = (areas.clone().min().unwrap(), areas.max().unwrap());
            assert!(most <= 3 * least, "{count}: {least} to {most} pixels");
            for (i, a) in tiles.iter().enumerate() {
                assert!(rect.contains_rect(a) && a.area() > 0);
                assert!(tiles[..i].iter().all(|b| a.intersection(b).is_none()), "{count}: {a:?}");
            }
            assert_eq!(rect.tile(count, count), None);
        }
        assert_eq!(rect.tile(0, 2), Some(Rect { x: 5, y: 7, width: 15, height: 17 }));
        assert_eq!(rect.tile(0, 0), None);
        assert_eq!(Rect::full(2, 2).tile(0, 5), None);
    }
}
