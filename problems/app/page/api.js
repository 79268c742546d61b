// SPDX-License-Identifier: GPL-3.0-or-later
// Requests to the program. Every address lies below the page's address, which contains the token.

async function answerOf(response) {
  const type = response.headers.get('Content-Type') || '';
  const answer = type.startsWith('application/json') ? await response.json() : await response.text();
  if (!response.ok) { throw new Error(answer.error || answer || `the program replied with status ${response.status}`); }
  if (answer.refused !== undefined) { throw new Error(answer.refused); }
  return answer;
}

async function fetchFrom(address, options) {
  try {
    return await fetch(address, options);
  } catch {
    throw new Error('The program does not answer; it may have ended. Start it again; nothing is lost.');
  }
}

const ask = async (address, options) => answerOf(await fetchFrom(address, options));

const addressOf = (path, query) => {
  const text = new URLSearchParams(query).toString();
  return `api/${path}${text ? `?${text}` : ''}`;
};

export const get = (path, query = {}) => ask(addressOf(path, query));

// A file made by the program, with its name.
export const getFile = async (path, query) => {
  const response = await fetchFrom(addressOf(path, query));
  const named = /filename="([^"]*)"/.exec(response.headers.get('Content-Disposition') || '');
  if (!response.ok || !named) {
    await answerOf(response);
    throw new Error('The program sent no file.');
  }
  return {name: named[1], blob: await response.blob()};
};

export const post = (path, body) =>
    ask(`api/${path}`, {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body)});

// Uploads one file of a batch. Files that belong together share a batch. Uploading opens nothing.
export const upload = (file, batch, name) =>
    ask(`api/upload?${new URLSearchParams({batch, name})}`,
        {method: 'POST', headers: {'Content-Type': 'application/octet-stream'}, body: file});
