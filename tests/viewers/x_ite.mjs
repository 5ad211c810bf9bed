// Takes a picture of every mode of an X3D file in X_ITE: node x_ite.mjs FILE.x3d FOLDER
import { chromium } from 'playwright-core';
import { createServer } from 'node:http';
import { mkdirSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [, , file, folder] = process.argv;
const library = join(dirname(fileURLToPath(import.meta.url)), 'node_modules/x_ite/dist');
const page = `<!doctype html><script src="/x_ite/x_ite.min.js"></script>
<style>body { margin: 0 } x3d-canvas { width: 800px; height: 600px }</style><x3d-canvas></x3d-canvas>`;
const types = { js: 'text/javascript', css: 'text/css', html: 'text/html' };

const server = createServer((request, response) => {
  if (request.url === '/favicon.ico') { response.writeHead(204).end(); return; }
  const [body, type] = request.url === '/'
    ? [() => page, 'html']
    : [() => readFileSync(request.url === '/scene.x3d' ? file : join(library, request.url.slice('/x_ite/'.length))), request.url.split('.').pop()];
  response.setHeader('content-type', types[type] ?? 'application/octet-stream');
  try {
    response.end(body());
  } catch {
    response.writeHead(404).end();
  }
}).listen(0, 'localhost');

mkdirSync(folder, { recursive: true });
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
const tab = await browser.newPage({ viewport: { width: 800, height: 600 } });
tab.on('console', message => console.log(message.type(), message.text().slice(0, 300)));
await tab.goto(`http://localhost:${server.address().port}/`);
const opened = await tab.evaluate(async () => {
  const { browser } = document.querySelector('x3d-canvas');
  await new Promise(resolve => setTimeout(resolve, 500));
  const start = performance.now();
  await browser.loadURL(new X3D.MFString('/scene.x3d'));
  for (let frame = 0; frame < 2; frame++) {
    await browser.nextFrame();
    await new Promise(requestAnimationFrame);
  }
  return performance.now() - start;
});
console.log(`opened in ${(opened / 1000).toFixed(2)} s`);
for (let mode = 0; mode < 7; mode++) {
  const shown = await tab.evaluate(async mode => {
    const { browser } = document.querySelector('x3d-canvas');
    if (mode) browser.currentScene.getNamedNode(`View${mode}`).set_bind = true;
    await new Promise(resolve => setTimeout(resolve, 3000));
    return `${browser.currentScene.getNamedNode('Mode').whichChoice} ${browser.activeViewpoint.description}`;
  }, mode);
  console.log(mode, shown);
  await tab.screenshot({ path: join(folder, `x_ite-${mode}.png`), timeout: 300000 });
}
await browser.close();
server.close();
