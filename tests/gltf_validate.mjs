// Whether the Khronos glTF validator accepts the GLB files that the tool writes.
//
//     node tests/gltf_validate.mjs build/patchsurf MESH...
//
// Tessellates each mesh to GLB at a low and a high rate, so with either width of indices, and hands
// the bytes to the validator: no error, no warning. Then damages an index, which it must find. The
// validator is the npm package gltf-validator, installed in build/gltf_validator when it is not
// there; where that is not possible, the exit status is 77: skipped.

import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';

const folder = resolve('build/gltf_validator');
const wanted = 'gltf-validator@2.0.0-dev.3.10';

function loadValidator() {
    if (!existsSync(`${folder}/node_modules/gltf-validator`)) {
        mkdirSync(folder, { recursive: true });
        const options = ['--prefix', folder, '--no-audit', '--no-fund', '--ignore-scripts',
            '--fetch-retries=1'];
        const done = spawnSync('npm', ['install', ...options, wanted],
            { encoding: 'utf8', timeout: 120000 });
        if (done.status !== 0) {
            console.log(done.stderr ?? String(done.error));
            console.log(`${wanted} could not be installed with npm`);
            process.exit(77);
        }
    }
    return createRequire(`${folder}/`)('gltf-validator');
}

async function problems(validator, bytes) {
    const { issues } = await validator.validateBytes(bytes, { maxIssues: 20 });
    return issues.messages.filter(({ severity }) => severity <= 1);     // errors and warnings
}

const [tool, ...meshes] = process.argv.slice(2);
const validator = loadValidator();
let failures = meshes.length ? 0 : 1;
let file = Buffer.alloc(0);

for (const mesh of meshes) {
    for (const rate of ['2', '40']) {
        const glb = `${folder}/mesh.glb`;
        execFileSync(tool, ['tessellate', mesh, '-o', glb, '--rate', rate, '--quiet']);
        file = readFileSync(glb);
        const found = await problems(validator, new Uint8Array(file));
        console.log(`${mesh}, rate ${rate}: ${file.length} bytes, ${found.length} problems`);
        for (const { code, pointer, message } of found) {
            console.log(`    ${code} ${pointer} ${message}`);
        }
        failures += found.length > 0;
    }
}

file.fill(0xff, file.length - 2);       // the last index, or its upper half: no such vertex
if ((await problems(validator, new Uint8Array(file))).length === 0) {
    console.log('a damaged file was accepted');
    failures++;
}
process.exit(failures ? 1 : 0);
