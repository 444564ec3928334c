//! Temporary.
use alhazen::*;
#[test]
fn tune() {
    let var = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into());
    let num = |n: &str, d: &str| var(n, d).parse::<u32>().unwrap();
    let text = var("SCENE", "cornell");
    let (name, cam) = text.split_once('@').map_or((text.as_str(), None), |(a, b)| (a, Some(b)));
    let mut loaded = Source::parse(name).load(&LoadOptions::default()).unwrap();
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    let mut job = Job { width: num("W", "256"), height: num("H", "144"), ..Job::for_scene(&loaded.scene) };
    if let Some(cam) = cam {
        let v: Vec<f32> = cam.split([',', ':']).map(|x| x.parse().unwrap()).collect();
        job.camera.eye = glam::vec3(v[0], v[1], v[2]);
        job.camera.target = glam::vec3(v[3], v[4], v[5]);
    }
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(&loaded.scene).unwrap();
    let cpu = || {
        let s = std::fs::read_to_string("/proc/self/stat").unwrap();
        let f: Vec<&str> = s.rsplit(") ").next().unwrap().split(' ').collect();
        (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
    };
    for g in var("G", "off,on").split(',') {
        if let Integrator::Path(p) = &mut job.integrator { p.guiding = g.parse().unwrap(); }
        job.seed = num("SEED", "1");
        let t = cpu();
        let limits = Limits { spp: num("SPP", "8"), ..Limits::default() };
        renderer.restart();
        renderer.render(&job, &limits, &Control::new()).unwrap();
        let t = cpu() - t;
        for n in renderer.take_notices() { println!("{n}"); }
        let film = renderer.film().unwrap().unwrap();
        let n = film.relative_error().unwrap();
        let mean = film.pixels().iter().map(|p| p.mean()[1]).sum::<f64>() / film.pixels().len() as f64;
        let level = film.pixels().iter().map(|p| p.mean().iter().sum::<f64>() / 3.0).sum::<f64>() / film.pixels().len() as f64;
        let mut v: Vec<f64> = film.pixels().iter().map(|p| {
            let (m, v) = (p.mean(), p.variance_of_mean().unwrap());
            (0..3).map(|c| v[c] / (m[c] * m[c] + 0.01 * level * level)).sum::<f64>() / 3.0
        }).collect();
        v.sort_by(f64::total_cmp);
        let n1 = v.len();
        let part = |share: f64| { let k = (n1 as f64 * share) as usize; v[..k].iter().sum::<f64>() / k as f64 };
        println!("   all {:.5} trimmed 0.1 % {:.5} 1 % {:.5} 5 % {:.5} median {:.5}", part(1.0), part(0.999), part(0.99), part(0.95), v[n1 / 2]);
        let means: Vec<f64> = film.pixels().iter().flat_map(|p| p.mean()).collect();
        if let Ok(r) = std::env::var("SAVE") {
            std::fs::write(r, means.iter().flat_map(|m| m.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
        }
        if let Ok(r) = std::env::var("REF") {
            let r: Vec<f64> = std::fs::read(r).unwrap().chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
            let level = r.iter().sum::<f64>() / r.len() as f64;
            let err = |eps: f64, cap: f64| {
                let mut e: Vec<f64> = r.iter().zip(&means).map(|(r, a)| (a - r) * (a - r) / (r * r + eps)).collect();
                e.sort_by(f64::total_cmp);
                let k = (e.len() as f64 * cap) as usize;
                e[..k].iter().sum::<f64>() / k as f64
            };
            println!("   relMSE {:.5}, by level {:.5}, without 0.1 % {:.5}; time x relMSE {:.5} {:.5}", err(0.01, 1.0), err(0.01 * level * level, 1.0), err(0.01 * level * level, 0.999), t * err(0.01, 1.0), t * err(0.01 * level * level, 1.0));
        }
        if let Ok(out) = std::env::var("OUT") {
            let bytes: Vec<u8> = film.pixels().iter().flat_map(|p| p.mean().map(|c| ((c / level * 0.35).min(1.0).powf(1.0 / 2.2) * 255.0) as u8)).collect();
            std::fs::write(format!("{out}-{g}.ppm"), [format!("P6 {} {} 255\n", job.width, job.height).into_bytes(), bytes].concat()).unwrap();
        }
        println!("{name} {g}: cpu {t:.2} s noise {n:.4} mean {mean:.5} eff {:.3}", 1.0 / (n * n * t));
    }
}
