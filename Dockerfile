# Both of the README's commands in a container, as nobody in particular:
#   docker build --tag swarm-pz .
#   docker run --volume "$PWD/runs:/home/player/swarm-pz/runs" swarm-pz
#   docker run swarm-pz scripts/test
# Tests of pages are left out: they need Chromium.
FROM python:3.11-slim
RUN useradd --create-home player
USER player
WORKDIR /home/player/swarm-pz
COPY --chown=player . .
RUN scripts/setup dev
CMD ["scripts/train"]
