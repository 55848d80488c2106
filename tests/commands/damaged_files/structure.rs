//! Where the parts of a file end and where its offsets and lengths stand, as far as this knows the format: that is where readers go wrong.

/// A number that says where something is, or how much of it there is.
#[derive(Clone, Copy, Debug)]
pub struct Offset {
    /// Where it stands.
    pub at: usize,
    /// How long it is, in bytes.
    pub bytes: usize,
    /// Whether its first byte is the largest one.
    pub is_big_endian: bool,
}

impl Offset {
    const fn little(at: usize, bytes: usize) -> Self {
        Self { at, bytes, is_big_endian: false }
    }

    fn get(&self, whole: &[u8]) -> u64 {
        let digits = &whole[self.at..self.at + self.bytes];
        let push = |value: u64, &digit: &u8| value << 8 | u64::from(digit);
        if self.is_big_endian { digits.iter().fold(0, push) } else { digits.iter().rev().fold(0, push) }
    }

    /// A copy of `whole` in which it is `value`, as far as that has room.
    pub fn with(&self, whole: &[u8], value: u64) -> Vec<u8> {
        let mut digits = value.to_le_bytes()[..self.bytes].to_vec();
        if self.is_big_endian {
            digits.reverse();
        }
        let mut copy = whole.to_vec();
        copy[self.at..self.at + self.bytes].copy_from_slice(&digits);
        copy
    }

    /// Copies of `whole` in which it points back, to the beginning, to itself, and beyond everything.
    fn patches(&self, whole: &[u8]) -> [Vec<u8>; 4] {
        [self.get(whole) / 2, 0, self.at as u64, u64::MAX].map(|value| self.with(whole, value))
    }
}

/// What is known of a file.
#[derive(Default)]
pub struct Structure {
    /// Where its parts end, counted from its beginning.
    pub ends: Vec<usize>,
    /// Its offsets and lengths.
    pub offsets: Vec<Offset>,
}

impl Structure {
    /// Of a file of the format with this name, which is whole.
    pub fn of(format: &str, whole: &[u8]) -> Self {
        let mut structure = Self::default();
        match format {
            "png" => structure.png(whole),
            "jpg" => structure.jpg(whole),
            "exr" => structure.exr(whole),
            "vdb" => structure.vdb(whole),
            "nvdb" => structure.nvdb(whole),
            "pbrt.gz" => structure.ends = vec![2, 10, 11, whole.len() - 8, whole.len() - 4],
            // A header of 18 bytes; the first row.
            "tga" => structure.ends = vec![12, 18, 18 + 16 * 3],
            "hdr" | "pfm" => structure.ends = lines(whole, 3),
            "ply" if !is_text(whole) => {
                let header = position(whole, b"end_header\n").expect("a header") + 11;
                // Four vertices of three floats; a face of a count and three numbers.
                structure.ends = lines(&whole[..header], 2);
                structure.ends.extend([header, header + 48, header + 49, header + 61]);
            }
            _ => structure.ends = [lines(whole, 6), words(whole, 4)].concat(),
        }
        structure.ends.retain(|&end| end < whole.len());
        structure
    }

    /// Copies of `whole` that end where a part does, and such that have an offset or length wrong.
    pub fn damaged(&self, whole: &[u8]) -> Vec<(String, Vec<u8>)> {
        let cut = self.ends.iter().map(|&end| (format!("cut at {end}"), whole[..end].to_vec()));
        let patched = self.offsets.iter().flat_map(|offset| {
            let copies = offset.patches(whole).into_iter().zip(["half", "0", "itself", "all ones"]);
            copies.map(|(copy, what)| (format!("{what} at {}", offset.at), copy))
        });
        cut.chain(patched).collect()
    }

    /// A signature; chunks of a length, a type, data and a sum.
    fn png(&mut self, whole: &[u8]) {
        let mut at = 8;
        while at + 12 <= whole.len() {
            let length = Offset { at, bytes: 4, is_big_endian: true };
            self.ends.extend([at, at + 8]);
            self.offsets.push(length);
            at += 12 + length.get(whole) as usize;
        }
    }

    /// Segments of a mark, a length and data, up to the scan.
    fn jpg(&mut self, whole: &[u8]) {
        let mut at = 2;
        while at + 4 <= whole.len() && whole[at] == 0xff {
            self.ends.push(at);
            let length = Offset { at: at + 2, bytes: 2, is_big_endian: true };
            if whole[at + 1] == 0xda {
                self.ends.push(at + 2 + length.get(whole) as usize);
                self.offsets.push(length);
                break;
            }
            at += 2 + length.get(whole) as usize;
        }
    }

    /// Attributes of a name, a type, a size and data, up to an empty name; a table of the blocks' places, of which the first says how long it is.
    fn exr(&mut self, whole: &[u8]) {
        let text = |at: usize| at + whole[at..].iter().position(|&byte| byte == 0).expect("an end of the text") + 1;
        let mut at = 8;
        self.ends.push(at);
        while whole[at] != 0 {
            let size = text(text(at));
            at = size + 4 + Offset::little(size, 4).get(whole) as usize;
        }
        let table = at + 1;
        let first = Offset::little(table, 8).get(whole) as usize;
        self.ends.extend([at, table, table + 8, first, first + 8]);
        self.offsets.extend((table..first).step_by(8).take(3).map(|at| Offset::little(at, 8)));
    }

    /// Each grid's place stands right before it, followed by those of its blocks and of its end. Texts have their length before them.
    fn vdb(&mut self, whole: &[u8]) {
        // The mark, the version, that of the library, whether there are offsets, a number of the file.
        self.ends.extend([8, 12, 20, 21, 57]);
        for at in 0..whole.len().saturating_sub(24) {
            let places = [0, 8, 16].map(|step| Offset::little(at + step, 8));
            let [grid, blocks, end] = places.map(|place| place.get(whole) as usize);
            if grid == at + 24 && (grid..end).contains(&blocks) && end <= whole.len() {
                self.ends.extend([at, grid, blocks, end]);
                self.offsets.extend(places);
            }
        }
        for name in [&b"density"[..], b"flame", b"file_bbox_min"] {
            let length = position(whole, name).expect("the name is there") - 4;
            assert_eq!(Offset::little(length, 4).get(whole), name.len() as u64);
            self.offsets.push(Offset::little(length, 4));
        }
    }

    /// A segment's header, what is said of its grid, the grid's name, and the grid: its head, tree and root.
    fn nvdb(&mut self, whole: &[u8]) {
        let name = 16 + 176;
        let grid = name + Offset::little(16 + 136, 4).get(whole) as usize;
        self.ends.extend([16, name, grid, grid + 8, grid + 672, grid + 736, grid + 800]);
        // The grid's size in memory and in the file.
        self.offsets.extend([Offset::little(16, 8), Offset::little(24, 8)]);
    }
}

/// Whether it is text.
pub fn is_text(whole: &[u8]) -> bool {
    whole.is_ascii() && !whole.contains(&0)
}

fn position(whole: &[u8], part: &[u8]) -> Option<usize> {
    whole.windows(part.len()).position(|window| window == part)
}

/// The ends of at most `most` lines, evenly spread.
fn lines(whole: &[u8], most: usize) -> Vec<usize> {
    let ends = whole.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at + 1);
    spread(ends.collect(), most)
}

/// The same of words.
fn words(whole: &[u8], most: usize) -> Vec<usize> {
    let is_end = |at: &usize| !whole[at - 1].is_ascii_whitespace() && whole[*at].is_ascii_whitespace();
    spread((1..whole.len()).filter(is_end).collect(), most)
}

fn spread(all: Vec<usize>, most: usize) -> Vec<usize> {
    let count = all.len().min(most);
    (0..count).map(|i| all[i * all.len() / count]).collect()
}
