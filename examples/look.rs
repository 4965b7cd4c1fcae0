use cumuli::{reference::*, scene::Scene, tables::TableSet};
use glam::DVec3;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = Scene::load(std::path::Path::new(&a[1])).unwrap();
    let size: u32 = a[3].parse().unwrap();
    let spp: u32 = a[4].parse().unwrap();
    let mut w = World::new(&scene, &TableSet::embedded().unwrap(), 0.0).unwrap();
    w.surroundings.radiance = DVec3::new(0.03, 0.045, 0.08);
    println!("{} particles", w.medium.particles().len());
    let mut f = Film::new([size, size * 9 / 16]);
    let t = std::time::Instant::now();
    w.expose(&mut f, 1, spp);
    println!("{:?}", t.elapsed());
    let mut img = image::RgbImage::new(f.size[0], f.size[1]);
    for (i, p) in img.pixels_mut().enumerate() {
        let e = f.estimates(i);
        for c in 0..3 {
            let v = e[c].value * 4.0;
            let v = 1.0 - (-v).exp();
            p[c] = (v.powf(1.0 / 2.2) * 255.0) as u8;
        }
    }
    img.save(&a[2]).unwrap();
}
