//! Experiment: discrete ordinates on a grid against the path tracer.
use cumuli::medium::Phase;
use cumuli::reference::*;
use cumuli::scene::Scene;
use cumuli::tables::TableSet;
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::time::Instant;

fn clump(tau: f64, sun: DVec3, inside: bool, seed: u64, phase: &str) -> String {
    // 200 overlapping spheres in an ellipsoid.
    let mut r = Random::new(seed, 1, 2);
    let (a, b) = (1000.0, 500.0);
    let mut parts = String::new();
    let n = 200;
    let mut vol = 0.0;
    let mut list = vec![];
    while list.len() < n {
        let p = DVec3::new(r.unit(), r.unit(), r.unit()) * 2.0 - 1.0;
        if p.length() > 1.0 { continue; }
        let radius = 100.0 + 100.0 * r.unit();
        list.push((DVec3::new(p.x * a, 1500.0 + p.y * b, p.z * a), radius));
        vol += 4.0 / 3.0 * PI * radius.powi(3);
    }
    // mean extinction through the middle: tau = ext * vol / V * 2a
    let v = 4.0 / 3.0 * PI * a * a * b;
    let ext = tau / (vol / v * 2.0 * b);
    for (c, radius) in list {
        parts += &format!("[[particles]]\ncentre=[{},{},{}]\nradius={}\nextinction={}\n", c.x, c.y, c.z, radius, ext);
    }
    let cam = if inside { "position=[100.0,1450.0,50.0]\ntarget=[900.0,1500.0,300.0]\nfov_x=80.0" } else { "position=[0.0,1500.0,3400.0]\ntarget=[0.0,1500.0,0.0]\nfov_x=45.0" };
    format!("[camera]\n{cam}\n[sun]\ndirection=[{},{},{}]\nangular_diameter=0.533\n[sky]\nkind=\"uniform\"\nradiance=0.0\n[medium]\nphase=\"{phase}\"\nalbedo=1.0\n{parts}", sun.x, sun.y, sun.z)
}

struct Grid { low: DVec3, h: f64, n: [usize; 3], beta: Vec<f32> }
impl Grid {
    fn new(parts: &[WorldParticle], h: f64, scale: f64, sub: usize) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in parts { low = low.min(p.centre - p.radius); high = high.max(p.centre + p.radius); }
        low -= h * 0.5; high += h * 0.5;
        let n = ((high - low) / h).ceil().as_ivec3();
        let n = [n.x as usize, n.y as usize, n.z as usize];
        let mut acc = vec![0.0f64; n[0] * n[1] * n[2]];
        let w = 1.0 / (sub * sub * sub) as f64;
        for p in parts {
            let a = ((p.centre - p.radius - low) / h).floor().as_ivec3().max(IVec3::ZERO);
            let b = ((p.centre + p.radius - low) / h).floor().as_ivec3().min(IVec3::new(n[0] as i32 - 1, n[1] as i32 - 1, n[2] as i32 - 1));
            for z in a.z..=b.z { for y in a.y..=b.y { for x in a.x..=b.x {
                let mut s = 0.0;
                for k in 0..sub { for j in 0..sub { for i in 0..sub {
                    let q = low + h * (DVec3::new(x as f64, y as f64, z as f64) + (DVec3::new(i as f64, j as f64, k as f64) + 0.5) / sub as f64);
                    s += p.extinction_at(q);
                }}}
                acc[(z as usize * n[1] + y as usize) * n[0] + x as usize] += s * w * scale;
            }}}
        }
        Self { low, h, n, beta: acc.into_iter().map(|v| v as f32).collect() }
    }
    fn tri(&self, f: &[f32], p: DVec3) -> f64 {
        let q = (p - self.low) / self.h - 0.5;
        let c = q.floor(); let t = q - c;
        let mut s = 0.0;
        for k in 0..8 {
            let o = [k & 1, k >> 1 & 1, k >> 2];
            let mut w = 1.0; let mut idx = [0usize; 3];
            for a in 0..3 {
                w *= if o[a] == 1 { t[a] } else { 1.0 - t[a] };
                idx[a] = (c[a] as i64 + o[a] as i64).clamp(0, self.n[a] as i64 - 1) as usize;
            }
            s += w * f[(idx[2] * self.n[1] + idx[1]) * self.n[0] + idx[0]] as f64;
        }
        s
    }
    /// Short characteristics along `dir` (direction of travel), source per optical depth. out: psi
    fn sweep(&self, dir: DVec3, source: Option<&[f32]>, boundary: f32, psi: &mut [f32], linear: bool) {
        let a = dir.abs();
        let axis = if a.x >= a.y && a.x >= a.z { 0 } else if a.y >= a.z { 1 } else { 2 };
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let n = self.n;
        let stride = [1, n[0], n[0] * n[1]];
        let forward = dir[axis] > 0.0;
        let sb = (dir[b] / a[axis]) as f32; let sc = (dir[c] / a[axis]) as f32;
        let step = (self.h / a[axis]) as f32;
        for s in 0..n[axis] {
            let i = if forward { s } else { n[axis] - 1 - s };
            for kc in 0..n[c] { for kb in 0..n[b] {
                let at = i * stride[axis] + kb * stride[b] + kc * stride[c];
                // upstream point
                let ub = kb as f32 - sb; let uc = kc as f32 - sc;
                let (mut up, mut bu, mut su) = (boundary, 0.0f32, 0.0f32);
                if s > 0 {
                    let j = if forward { i - 1 } else { i + 1 };
                    let fb = ub.floor(); let fc = uc.floor();
                    let (tb, tc) = (ub - fb, uc - fc);
                    up = 0.0;
                    for o in 0..4 {
                        let (ob, oc) = (o & 1, o >> 1);
                        let w = (if ob == 1 { tb } else { 1.0 - tb }) * (if oc == 1 { tc } else { 1.0 - tc });
                        if w == 0.0 { continue; }
                        let (xb, xc) = (fb as i64 + ob, fc as i64 + oc);
                        if xb < 0 || xc < 0 || xb >= n[b] as i64 || xc >= n[c] as i64 { up += w * boundary; }
                        else {
                            let k = j * stride[axis] + xb as usize * stride[b] + xc as usize * stride[c];
                            up += w * psi[k]; bu += w * self.beta[k];
                            if let Some(src) = source { su += w * src[k] * self.beta[k]; }
                        }
                    }
                    if bu > 0.0 { su /= bu; }
                }
                let bp = self.beta[at];
                let sp = source.map_or(0.0, |v| v[at]);
                let tau = 0.5 * (bu + bp) * step;
                let e = (-tau).exp();
                let v = if linear {
                    // linear in tau
                    let one = -(-tau).exp_m1();
                    let m = if tau > 1e-3 { 1.0 - one / tau } else { tau * 0.5 - tau * tau / 6.0 };
                    // weights: downstream m, upstream one - m
                    up * e + sp * m + su * (one - m)
                } else { up * e + sp * (1.0 - e) };
                psi[at] = v;
            }}
        }
    }
    /// Upwind finite volumes (step).
    fn upwind(&self, dir: DVec3, source: Option<&[f32]>, boundary: f32, psi: &mut [f32]) {
        let n = self.n; let st = [1usize, n[0], n[0] * n[1]];
        let a = [dir.x.abs() as f32 / self.h as f32, dir.y.abs() as f32 / self.h as f32, dir.z.abs() as f32 / self.h as f32];
        let f = [dir.x > 0.0, dir.y > 0.0, dir.z > 0.0];
        let sum = a[0] + a[1] + a[2];
        for kz in 0..n[2] { let z = if f[2] { kz } else { n[2] - 1 - kz };
        for ky in 0..n[1] { let y = if f[1] { ky } else { n[1] - 1 - ky };
        for kx in 0..n[0] { let x = if f[0] { kx } else { n[0] - 1 - kx };
            let at = z * st[2] + y * st[1] + x;
            let up = |k: usize, axis: usize| if k == 0 { boundary } else if f[axis] { psi[at - st[axis]] } else { psi[at + st[axis]] };
            let s = a[0] * up(kx, 0) + a[1] * up(ky, 1) + a[2] * up(kz, 2);
            let b = self.beta[at];
            psi[at] = (s + b * source.map_or(0.0, |v| v[at])) / (sum + b);
        }}}
    }
}

/// Directions and weights (sum 4 pi).
fn directions(polar: usize, azimuths: usize) -> Vec<(DVec3, f64)> {
    if polar == 12 || polar == 20 {
        let g = (1.0 + 5f64.sqrt()) / 2.0;
        let mut v = vec![];
        for i in 0..3 { for a in [-1.0, 1.0] { for b in [-1.0, 1.0] {
            let (x, y, z) = if polar == 12 { (0.0, a, b * g) } else { (0.0, a / g, b * g) };
            v.push(match i { 0 => DVec3::new(x, y, z), 1 => DVec3::new(z, x, y), _ => DVec3::new(y, z, x) });
        }}}
        if polar == 20 { for a in [-1.0, 1.0] { for b in [-1.0, 1.0] { for c in [-1.0, 1.0] { v.push(DVec3::new(a, b, c)); } } } }
        let n = v.len() as f64;
        return v.into_iter().map(|d| (d.normalize(), 4.0 * PI / n)).collect();
    }
    let (x, w): (Vec<f64>, Vec<f64>) = match polar {
        2 => (vec![-0.5773502692, 0.5773502692], vec![1.0, 1.0]),
        4 => (vec![-0.8611363116, -0.3399810436, 0.3399810436, 0.8611363116], vec![0.3478548451, 0.6521451549, 0.6521451549, 0.3478548451]),
        8 => (vec![-0.9602898565, -0.7966664774, -0.5255324099, -0.1834346425, 0.1834346425, 0.5255324099, 0.7966664774, 0.9602898565],
              vec![0.1012285363, 0.2223810345, 0.3137066459, 0.3626837834, 0.3626837834, 0.3137066459, 0.2223810345, 0.1012285363]),
        _ => panic!(),
    };
    let mut out = vec![];
    for i in 0..polar { for k in 0..azimuths {
        let phi = 2.0 * PI * (k as f64 + if i % 2 == 0 { 0.25 } else { 0.75 }) / azimuths as f64;
        let s = (1.0 - x[i] * x[i]).sqrt();
        out.push((DVec3::new(s * phi.cos(), x[i], s * phi.sin()), w[i] * 2.0 * PI / azimuths as f64));
    }}
    out
}
fn legendre(l: usize, x: f64) -> f64 { let (mut a, mut b) = (1.0, x); if l == 0 { return 1.0; } for k in 1..l { let c = ((2 * k + 1) as f64 * x * b - k as f64 * a) / (k + 1) as f64; a = b; b = c; } b }

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let get = |k: &str, d: f64| args.iter().position(|a| a == k).map_or(d, |i| args[i + 1].parse().unwrap());
    let gets = |k: &str, d: &str| args.iter().position(|a| a == k).map_or(d.to_string(), |i| args[i + 1].clone());
    let tau = get("tau", 30.0); let h = get("h", 32.0); let polar = get("polar", 4.0) as usize; let az = get("az", 6.0) as usize;
    let degree = get("degree", 3.0) as usize; let iters = get("iters", 100.0) as usize; let inside = get("inside", 0.0) > 0.0;
    let spp = get("spp", 64.0) as u32; let scheme = gets("scheme", "linear"); let phase_name = gets("phase", "hg:0.85");
    let sun = match gets("sun", "side").as_str() { "side" => DVec3::new(1.0, 1.0, 0.3), "front" => DVec3::new(0.2, 0.5, 1.0), "back" => DVec3::new(0.2, 0.4, -1.0), _ => DVec3::Y }.normalize();
    let key = format!("{tau}-{inside}-{}-{phase_name}-{spp}", gets("sun", "side"));
    let text = clump(tau, sun, inside, 5, &phase_name);
    let scene = Scene::from_toml(&text, "x", std::path::Path::new(".")).unwrap();
    let tables = TableSet::embedded().unwrap();
    let world = World::new(&scene, &tables, 0.0).unwrap();
    let size = [48u32, 27];
    // reference, cached
    let path = format!("/tmp/o/ref-{key}.bin");
    let npx = (size[0] * size[1]) as usize;
    let refs: Vec<[f64; 3]> = if let Ok(b) = std::fs::read(&path) {
        bytemuck::cast_slice::<u8, f64>(&b.clone()).chunks(3).map(|c| [c[0], c[1], c[2]]).collect()
    } else {
        let t = Instant::now();
        let mut film = Film::new(size);
        world.expose(&mut film, 1, spp);
        eprintln!("reference {:.1}s", t.elapsed().as_secs_f64());
        let v: Vec<[f64; 3]> = (0..npx).map(|i| { let e = film.estimates(i); [e[0].value, e[0].standard_error, e[3].value] }).collect();
        std::fs::create_dir_all("/tmp/o").ok();
        std::fs::write(&path, bytemuck::cast_slice(&v)).unwrap();
        v
    };
    let phase: Phase = phase_name.parse().unwrap();
    let prepared = phase.prepare();
    let m = phase.legendre_moments(degree + 2);
    let f = m[degree + 1];
    let scale = 1.0 - f;
    let parts = world.medium.particles();
    let t0 = Instant::now();
    let grid = Grid::new(parts, h, scale, 4);
    let cells = grid.beta.len();
    let dirs = directions(polar, az);
    let nd = dirs.len();
    let pm = |c: f64| (0..=degree).map(|l| (2 * l + 1) as f64 / (4.0 * PI) * (m[l] - f) / (1.0 - f) * legendre(l, c)).sum::<f64>();
    // scattering matrix, normalised so that each column sums to 1 (energy)
    let mut k: Vec<f64> = (0..nd * nd).map(|i| pm(dirs[i / nd].0.dot(dirs[i % nd].0)) * dirs[i % nd].1).collect();
    for j in 0..nd { let s: f64 = (0..nd).map(|i| k[i * nd + j] * dirs[i].1).sum::<f64>() / dirs[j].1; for i in 0..nd { k[i * nd + j] /= s; } }
    // sun
    let mut uncollided = vec![0.0f32; cells];
    {
        // average transmittance in the cell: exact marching from sub points on a fine grid
        let fine = Grid::new(parts, h / 4.0, scale, 2);
        let mut ft = vec![0.0f32; fine.beta.len()];
        fine.sweep(-sun, None, 1.0, &mut ft, true);
        // own half cell
        uncollided.par_iter_mut().enumerate().for_each(|(i, v)| {
            let c = [i % grid.n[0], i / grid.n[0] % grid.n[1], i / grid.n[0] / grid.n[1]];
            let mut s = 0.0;
            let mut ws = 0.0;
            for q in 0..64 {
                let o = DVec3::new((q % 4) as f64, (q / 4 % 4) as f64, (q / 16) as f64) + 0.5;
                let p = grid.low + grid.h * (DVec3::new(c[0] as f64, c[1] as f64, c[2] as f64) + o / 4.0);
                let w = fine.tri(&fine.beta, p) + 1e-9;
                s += w * fine.tri(&ft, p); ws += w;
            }
            *v = (s / ws) as f32;
        });
    }
    if get("coarse_sun", 0.0) > 0.0 { grid.sweep(-sun, None, 1.0, &mut uncollided, true); }
    let first: Vec<f32> = dirs.iter().map(|d| pm(d.0.dot(-sun)) as f32).collect();
    let mut psi = vec![vec![0.0f32; cells]; nd];
    let mut changes = vec![];
    let ts = Instant::now();
    let mut src: Vec<Vec<f32>> = vec![vec![0.0; cells]; nd];
    let weights: Vec<f32> = dirs.iter().map(|d| d.1 as f32).collect();
    let kf: Vec<f32> = k.iter().map(|v| *v as f32).collect();
    let make_src = |psi: &Vec<Vec<f32>>, src: &mut Vec<Vec<f32>>| {
        src.par_iter_mut().enumerate().for_each(|(d, s)| {
            for c in 0..cells { s[c] = first[d] * uncollided[c]; }
            for e in 0..nd { let w = kf[d * nd + e]; for (a, b) in s.iter_mut().zip(&psi[e]) { *a += w * b; } }
        });
    };
    if get("levels", 0.0) > 0.0 {
        let pyramid = get("levels", 0.0) as usize;
        let mut prev: Option<(Grid, Vec<Vec<f32>>)> = None;
        for l in (1..=pyramid).rev() {
            let g = Grid::new(parts, h * (1 << l) as f64, scale, 4);
            let nc = g.beta.len();
            let mut sunny = vec![0.0f32; nc]; g.sweep(-sun, None, 1.0, &mut sunny, true);
            let mut ps: Vec<Vec<f32>> = match &prev { None => vec![vec![0.0; nc]; nd], Some((pg, pp)) => pp.iter().map(|f| (0..nc).map(|i| pg.tri(f, g.low + g.h * (DVec3::new((i % g.n[0]) as f64, (i / g.n[0] % g.n[1]) as f64, (i / g.n[0] / g.n[1]) as f64) + 0.5)) as f32).collect()).collect() };
            let mut sr = vec![vec![0.0f32; nc]; nd];
            let its = if prev.is_none() { get("its0", 40.0) } else { get("its1", 8.0) } as usize;
            for _ in 0..its {
                for d in 0..nd { for c in 0..nc { sr[d][c] = first[d] * sunny[c] + (0..nd).map(|e| kf[d * nd + e] * ps[e][c]).sum::<f32>(); } }
                for d in 0..nd { g.sweep(dirs[d].0, Some(&sr[d]), 0.0, &mut ps[d], true); }
            }
            prev = Some((g, ps));
        }
        let (pg, pp) = prev.unwrap();
        for d in 0..nd { for i in 0..cells { psi[d][i] = pg.tri(&pp[d], grid.low + grid.h * (DVec3::new((i % grid.n[0]) as f64, (i / grid.n[0] % grid.n[1]) as f64, (i / grid.n[0] / grid.n[1]) as f64) + 0.5)) as f32; } }
    }
    for _ in 0..iters {
        make_src(&psi, &mut src);
        psi.par_iter_mut().enumerate().for_each(|(d, p)| {
            let dir = dirs[d].0;
            match scheme.as_str() { "upwind" => grid.upwind(dir, Some(&src[d]), 0.0, p), "step" => grid.sweep(dir, Some(&src[d]), 0.0, p, false), _ => grid.sweep(dir, Some(&src[d]), 0.0, p, true) }
        });
        let total: f64 = psi.iter().zip(&weights).map(|(p, w)| p.iter().zip(&grid.beta).map(|(a, b)| (a * b) as f64).sum::<f64>() * *w as f64).sum();
        changes.push(total);
    }
    let solve = ts.elapsed().as_secs_f64();
    make_src(&psi, &mut src);
    // energy: escape out / in
    let vol = grid.h.powi(3);
    let in_: f64 = uncollided.iter().zip(&grid.beta).map(|(a, b)| (a * b) as f64).sum::<f64>() * vol;
    // mean intensity of everything * beta: absorbed must be 0: in + scattered = collided
    let sc: f64 = changes.last().unwrap() * vol;
    let emitted: f64 = in_ + sc;
    let _ = emitted;
    // outflow through the faces
    let mut out = 0.0;
    for (d, p) in psi.iter().enumerate() {
        let (dir, w) = dirs[d];
        for i in 0..cells {
            let c = [i % grid.n[0], i / grid.n[0] % grid.n[1], i / grid.n[0] / grid.n[1]];
            for a in 0..3 { if (dir[a] > 0.0 && c[a] == grid.n[a] - 1) || (dir[a] < 0.0 && c[a] == 0) { out += p[i] as f64 * dir[a].abs() * w * grid.h * grid.h; } }
        }
    }
    eprintln!("cells {cells} {:?} f {f:.3} dirs {nd} solve {solve:.2}s ({:.1} ms/it) setup {:.1}s energy out/in {:.3}; convergence {:?}", grid.n, solve / iters as f64 * 1e3, t0.elapsed().as_secs_f64() - solve, out / in_,
        [iters/8, iters / 4, iters / 2, iters - 1].map(|i| (changes[i] / changes.last().unwrap() * 1000.0).round() / 1000.0));
    // halo: paths of forward-peak scatterings only
    let orders = if phase_name.starts_with("mie") { 1500 } else { 200 };
    let q_of = |x: f64| (prepared.eval(x) - scale * pm(x)) / f;
    let mut theta0 = PI; { let mut th = 0.0; while th < PI { if q_of(f64::cos(th)) <= 0.0 { theta0 = th; break; } th += 0.002; } }
    let quad: Vec<(f64, f64)> = { // midpoint in u, theta = theta0 u^2: fine at the peak
        let nq = 6000; (0..nq).map(|i| { let u = (i as f64 + 0.5) / nq as f64; let th = theta0 * u * u; (th.cos(), q_of(th.cos()) * 2.0 * PI * th.sin() * theta0 * 2.0 * u / nq as f64) }).collect() };
    let mut nl = vec![0.0; orders];
    for (x, w) in &quad { let (mut a, mut b) = (1.0, *x); for l in 0..orders { nl[l] += w * a; let c = ((2 * l + 3) as f64 * x * b - (l + 1) as f64 * a) / (l + 2) as f64; a = b; b = c; } }
    eprintln!("halo: theta0 {:.1} deg, share {:.3} of f {:.3}", theta0.to_degrees(), nl[0], f);
    let ms: Vec<f64> = (0..24).map(|i| 0.05 * 1.35f64.powi(i)).collect();
    let use_halo = get("halo", 1.0) > 0.0;
    // picture
    let fine = Grid::new(parts, h / 4.0, scale, 2);
    let mut ft = vec![0.0f32; fine.beta.len()];
    fine.sweep(-sun, None, 1.0, &mut ft, true);
    let cam = scene.camera;
    let high = grid.low + grid.h * DVec3::new(grid.n[0] as f64, grid.n[1] as f64, grid.n[2] as f64);
    let sub = 2;
    let pixels: Vec<[f64; 3]> = (0..npx).into_par_iter().map(|i| {
        let (px, py) = (i % size[0] as usize, i / size[0] as usize);
        let mut acc = [0.0; 3];
        for q in 0..sub * sub {
            let d = cam.ray((px as f64 + (0.5 + (q % sub) as f64) / sub as f64) / size[0] as f64, (py as f64 + (0.5 + (q / sub) as f64) / sub as f64) / size[1] as f64, size[0] as f64 / size[1] as f64);
            let inv = d.recip();
            let (a, b) = ((grid.low - cam.position) * inv, (high - cam.position) * inv);
            let t0 = a.min(b).max_element().max(0.0); let t1 = a.max(b).min_element();
            if t1 <= t0 { acc[2] += 1.0; continue; }
            let p1 = prepared.eval(d.dot(sun));
            let x = d.dot(sun);
            let nth = if x > theta0.cos() { q_of(x) } else { 0.0 };
            let mut hs = vec![0.0; ms.len()];
            { let (mut a, mut b) = (1.0, x); for l in 0..orders {
                for (h, m) in hs.iter_mut().zip(&ms) { *h += (2 * l + 1) as f64 / (4.0 * PI) * a * ((-m * (1.0 - nl[l])).exp() - (-m).exp() - m * (-m).exp() * nl[l]) / m; }
                let c = ((2 * l + 3) as f64 * x * b - (l + 1) as f64 * a) / (l + 2) as f64; a = b; b = c; } }
            for (h, m) in hs.iter_mut().zip(&ms) { *h += (-m).exp() * nth; }
            // weights of K row for the view direction: light travelling along -d
            let mut row: Vec<f64> = dirs.iter().map(|e| pm(e.0.dot(-d)) * e.1).collect();
            let s: f64 = row.iter().sum(); for r in &mut row { *r /= s; }
            let ds = h / 4.0; let mut t = t0 + 0.5 * ds; let (mut l, mut tr) = (0.0f64, 1.0f64); let mut l1 = 0.0;
            while t < t1 && tr > 1e-4 {
                let p = cam.position + d * t;
                let be = fine.tri(&fine.beta, p);
                if be > 0.0 {
                    let o = 1.0 - (-be * ds).exp();
                    let j: f64 = row.iter().zip(&psi).map(|(w, f)| if *w != 0.0 { w * grid.tri(f, p) } else { 0.0 }).sum();
                    let ts = fine.tri(&ft, p);
                    let mut pe = p1;
                    if use_halo {
                        let m = f / scale * (-(ts.max(1e-20)).ln() - tr.ln() + 0.5 * be * ds);
                        let at = ((m / ms[0]).ln() / 1.35f64.ln()).clamp(0.0, ms.len() as f64 - 1.001);
                        let (i, t) = (at as usize, at.fract());
                        let h = if m < ms[0] { nth + (hs[0] - nth) * m / ms[0] } else { hs[i] + (hs[i + 1] - hs[i]) * t };
                        pe = p1 + f * (h - nth);
                    }
                    let s1 = pe / scale * ts;
                    l += tr * o * (s1 + j.max(0.0)); l1 += tr * o * s1;
                    tr *= 1.0 - o;
                }
                t += ds;
            }
            acc[0] += l; acc[1] += l1; acc[2] += tr.powf(1.0 / scale);
        }
        acc.map(|v| v / (sub * sub) as f64)
    }).collect();
    let mask: Vec<usize> = (0..npx).filter(|&i| refs[i][2] < 0.5).collect();
    let nm = mask.len() as f64;
    let mr = mask.iter().map(|&i| refs[i][0]).sum::<f64>() / nm;
    let mg = mask.iter().map(|&i| pixels[i][0]).sum::<f64>() / nm;
    let m1 = mask.iter().map(|&i| pixels[i][1]).sum::<f64>() / nm;
    let noise = mask.iter().map(|&i| refs[i][1].powi(2)).sum::<f64>() / nm;
    let mse = mask.iter().map(|&i| (refs[i][0] - pixels[i][0]).powi(2)).sum::<f64>() / nm;
    let rel = mask.iter().map(|&i| ((refs[i][0] - pixels[i][0]).powi(2) - refs[i][1].powi(2)) / (refs[i][0].powi(2) + 1e-6)).sum::<f64>() / nm;
    let cov = mask.iter().map(|&i| (refs[i][0] - mr) * (pixels[i][0] - mg)).sum::<f64>() / (mask.iter().map(|&i| (refs[i][0] - mr).powi(2)).sum::<f64>() * mask.iter().map(|&i| (pixels[i][0] - mg).powi(2)).sum::<f64>()).sqrt();
    println!("tau {tau} inside {inside} sun {} {phase_name} h {h} dirs {nd} deg {degree} {scheme} it {iters}: mean {:.3} (order1 {:.3}) corr {:.4} rmse/mean {:.3} (noise {:.3}) relMSE {:.4}  mean {:.4} total time {:.0}", gets("sun", "side"), mg / mr, m1 / mr, cov, ((mse - noise).max(0.0)).sqrt() / mr, noise.sqrt() / mr, rel, mr, t0.elapsed().as_secs_f64());
    for (a, b) in [(0.0, 1e-6), (1e-6, 1e-4), (1e-4, 0.01), (0.01, 0.1), (0.1, 0.5), (0.5, 0.9), (0.9, 0.999)] {
        let sel: Vec<usize> = (0..npx).filter(|&i| pixels[i][2] >= a && pixels[i][2] < b).collect();
        if sel.is_empty() { continue; }
        let n = sel.len() as f64;
        let (r, g, o) = sel.iter().fold((0.0, 0.0, 0.0), |s, &i| (s.0 + refs[i][0] / n, s.1 + pixels[i][0] / n, s.2 + pixels[i][1] / n));
        let rel = sel.iter().map(|&i| ((refs[i][0] - pixels[i][0]).powi(2) - refs[i][1].powi(2)) / (refs[i][0].powi(2) + 1e-6)).sum::<f64>() / n;
        eprintln!("  T {a:.0e}..{b:.0e}: {n} px reference {r:.4} grid {g:.4} ratio {:.3} order1 share {:.3} relMSE {rel:.4}", g / r, o / g);
    }
    let tone = |v: f64| (255.0 * (1.0 - (-v / mr * 0.8).exp()).max(0.0).powf(1.0 / 2.2)) as u8;
    let mut img = vec![];
    for row in 0..size[1] as usize { for which in 0..2 { for x in 0..size[0] as usize { let i = row * size[0] as usize + x; img.push(tone(if which == 0 { refs[i][0] } else { pixels[i][0] })); } } }
    let mut s = format!("P5 {} {} 255\n", size[0] * 2, size[1]).into_bytes(); s.extend(img);
    std::fs::write("/tmp/o/grid.pgm", s).unwrap();
}
