MODULE Weld
RECORD gun
num count;
num force;
ENDRECORD
PERS num n:=1;
PERS num nTask:=1;
PERS num a{3}:=[1,2,3];
PERS num b{3}:=[1,2,3];
PERS num c{2}:=[1,2];
PERS gun g:=[1,2500];
PERS gun h:=[1,2500];
PERS robtarget pA:=[[100,200,300],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
PERS robtarget pB:=[[100,200,300],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
PROC main()
n:=n+1;
nTask:=nTask+1;
a{2}:=a{2}+1;
Incr b{i};
c{1}:=0;
g.count:=g.count+1;
h.count:=h.count+1;
pA.trans.z:=5;
MoveL pA,v100,fine,tool0;
pB:=CRobT();
MoveL pB,v100,fine,tool0;
ENDPROC
ENDMODULE
